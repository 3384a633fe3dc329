//! Addresses of a server, with the credentials to show there.

use axum::http::HeaderValue;

use super::error::FleetError;
use mrol_client::{Client, Credentials};

/// The gRPC address of a server.
#[derive(Debug, Clone)]
pub(crate) struct GrpcAddress {
    pub(crate) url: String,
    pub(crate) credentials: Credentials,
}

/// The HTTP address of a server, without TLS.
#[derive(Debug, Clone)]
pub(crate) struct HttpAddress {
    pub(crate) url: String,
    /// Authorization header, marked as sensitive so that no output shows it.
    pub(crate) authorization: Option<HeaderValue>,
}

impl GrpcAddress {
    /// The address of a server that asks for no key.
    pub(crate) fn open(url: impl Into<String>) -> Self {
        Self { url: url.into(), credentials: Credentials::default() }
    }

    pub(crate) async fn connect(&self) -> Result<Client, FleetError> {
        Ok(Client::connect_with(&self.url, &self.credentials).await?)
    }
}

impl HttpAddress {
    /// The address of a server that asks for no key.
    pub(crate) fn open(url: impl Into<String>) -> Self {
        Self { url: url.into(), authorization: None }
    }

    pub(crate) fn new(url: &str, secret: Option<&str>) -> Result<Self, FleetError> {
        if url.starts_with("https://") {
            return Err(FleetError::usage(
                "--http: HTTP is measured in the clear alone, at an http:// address",
            ));
        }
        let bearer = |secret| HeaderValue::try_from(format!("Bearer {secret}"));
        let mut authorization =
            secret.map(bearer).transpose().map_err(|_| FleetError::usage("--key is no secret of a key"))?;
        if let Some(value) = &mut authorization {
            value.set_sensitive(true);
        }
        Ok(Self { url: url.trim_end_matches('/').to_owned(), authorization })
    }
}
