//! Point queries over HTTP, bytes in and bytes out.

use axum::body::{Body, to_bytes};
use axum::http::header::AUTHORIZATION;
use axum::http::{HeaderValue, Request, Uri, header};
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use tokio_stream::StreamExt as _;

use super::address::HttpAddress;
use super::error::FleetError;
use mrol_service::PointCloud;

/// Most bytes of an answer: a bit a point, or an error's text.
const ANSWER_BYTES_MAX: usize = 1 << 20;

/// A connection to a server, with the URL of its queries.
pub(crate) struct HttpConnection {
    client: Client<HttpConnector, Body>,
    uri: Uri,
    authorization: Option<HeaderValue>,
}

impl HttpConnection {
    pub(crate) fn to(HttpAddress { url, authorization }: &HttpAddress) -> Result<Self, FleetError> {
        let uri = url.parse().map_err(|error| FleetError::usage(format!("{url}: {error}")))?;
        let mut connector = HttpConnector::new();
        connector.set_nodelay(true);
        Ok(Self {
            client: Client::builder(TokioExecutor::new()).build(connector),
            uri,
            authorization: authorization.clone(),
        })
    }

    /// A connection of its own for every request, as health checks come.
    pub(crate) fn each_time_to(HttpAddress { url, authorization }: &HttpAddress) -> Result<Self, FleetError> {
        let uri = url.parse().map_err(|error| FleetError::usage(format!("{url}: {error}")))?;
        let mut connector = HttpConnector::new();
        connector.set_nodelay(true);
        let client = Client::builder(TokioExecutor::new()).pool_max_idle_per_host(0).build(connector);
        Ok(Self { client, uri, authorization: authorization.clone() })
    }

    /// Asks for what is at the address and reads it to its end; returns how many bytes it has.
    pub(crate) async fn get(&self) -> Result<usize, FleetError> {
        let request = Request::get(self.uri.clone());
        let request =
            self.authorization.iter().fold(request, |request, key| request.header(AUTHORIZATION, key));
        let request = request.body(Body::empty()).map_err(FleetError::failed)?;
        let failed = |error: &dyn std::fmt::Display| FleetError::failed(format!("{}: {error}", self.uri));
        let answer = self.client.request(request).await.map_err(|error| failed(&error))?;
        let status = answer.status();
        if !status.is_success() {
            let text = to_bytes(Body::new(answer.into_body()), ANSWER_BYTES_MAX).await;
            let text = text.map_err(|error| failed(&error))?;
            return Err(failed(&format!("{status}: {}", String::from_utf8_lossy(&text))));
        }
        let (mut pieces, mut bytes) = (Body::new(answer.into_body()).into_data_stream(), 0);
        while let Some(piece) = pieces.next().await {
            bytes += piece.map_err(|error| failed(&error))?.len();
        }
        Ok(bytes)
    }

    /// Queries `points`; returns how many of them are occupied.
    pub(crate) async fn ask(&self, points: PointCloud) -> Result<usize, FleetError> {
        let request =
            Request::post(self.uri.clone()).header(header::CONTENT_TYPE, "application/octet-stream");
        let request =
            self.authorization.iter().fold(request, |request, key| request.header(AUTHORIZATION, key));
        let request = request.body(Body::from(points.into_bytes())).map_err(FleetError::failed)?;
        let failed = |error: &dyn std::fmt::Display| FleetError::failed(format!("{}: {error}", self.uri));
        let answer = self.client.request(request).await.map_err(|error| failed(&error))?;
        let status = answer.status();
        let bitmap = to_bytes(Body::new(answer.into_body()), ANSWER_BYTES_MAX)
            .await
            .map_err(|error| failed(&error))?;
        if !status.is_success() {
            return Err(failed(&format!("{status}: {}", String::from_utf8_lossy(&bitmap))));
        }
        Ok(bitmap.iter().map(|byte| byte.count_ones() as usize).sum())
    }
}
