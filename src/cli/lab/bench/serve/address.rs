//! Where a server is asked, and what is shown there.

use axum::http::HeaderValue;

use crate::cli::error::CliError;
use crate::client::{Client, Credentials};

/// Of gRPC.
#[derive(Debug, Clone)]
pub(in crate::cli::lab::bench) struct GrpcAddress {
    pub(in crate::cli::lab::bench) url: String,
    pub(in crate::cli::lab::bench) credentials: Credentials,
}

/// Of HTTP, in the clear.
#[derive(Debug, Clone)]
pub(in crate::cli::lab::bench) struct HttpAddress {
    pub(in crate::cli::lab::bench) url: String,
    /// Marked as sensitive: no output shows it.
    pub(in crate::cli::lab::bench) authorization: Option<HeaderValue>,
}

impl GrpcAddress {
    /// Of a server that asks for no key.
    pub(in crate::cli::lab::bench) fn open(url: impl Into<String>) -> Self {
        Self { url: url.into(), credentials: Credentials::default() }
    }

    pub(in crate::cli::lab::bench) async fn connect(&self) -> Result<Client, CliError> {
        Ok(Client::connect_with(&self.url, &self.credentials).await?)
    }
}

impl HttpAddress {
    /// Of a server that asks for no key.
    pub(in crate::cli::lab::bench) fn open(url: impl Into<String>) -> Self {
        Self { url: url.into(), authorization: None }
    }

    pub(in crate::cli::lab::bench) fn new(url: &str, secret: Option<&str>) -> Result<Self, CliError> {
        if url.starts_with("https://") {
            return Err(CliError::usage(
                "--http: HTTP is measured in the clear alone, at an http:// address",
            ));
        }
        let bearer = |secret| HeaderValue::try_from(format!("Bearer {secret}"));
        let mut authorization =
            secret.map(bearer).transpose().map_err(|_| CliError::usage("--key is no secret of a key"))?;
        if let Some(value) = &mut authorization {
            value.set_sensitive(true);
        }
        Ok(Self { url: url.trim_end_matches('/').to_owned(), authorization })
    }
}
