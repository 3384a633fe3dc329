//! Bodies: JSON, or points as bytes with the rest of the request in the query.

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, FromRequest, Request};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;

use super::object::Object;
use super::{params, unreadable};
use crate::access::Authorized;
use crate::admission::{InboundBody, off_runtime};
use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use mrol_client::wire::InField;
use mrol_map::util::excerpt;
use mrol_service::{MapService, PointCloud, Reason, ServiceError};

const JSON: &str = "application/json";
const OCTET_STREAM: &str = "application/octet-stream";

/// Memory for JSON and what is made of it, as a multiple of the former: points are longer than their shortest text of
/// eight bytes, and lie in a list that doubles its room, the old one beside the new; the answer to them is shorter.
const JSON_AND_PARSED: usize = 6;

/// A body that is all of the request.
pub(in crate::http) struct Json<T>(pub(in crate::http) T);

impl<T: DeserializeOwned + Send + 'static> FromRequest<Adapter> for Json<T> {
    type Rejection = HttpError;

    async fn from_request(request: Request, adapter: &Adapter) -> Result<Self, HttpError> {
        match content_type(request.headers()).as_str() {
            JSON => parse_all(request, adapter).await.map(|(parsed, _)| Self(parsed)),
            other => Err(unsupported(other, JSON)),
        }
    }
}

/// A body with points: as JSON `J` with everything, or as bytes with the rest, `Q`, in the query.
pub(in crate::http) enum Points<J, Q> {
    Json(J),
    Bytes(Bytes, Q),
}

impl<J, Q> FromRequest<Adapter> for Points<J, Q>
where
    J: DeserializeOwned + Send + 'static,
    Q: DeserializeOwned + Send,
{
    type Rejection = HttpError;

    async fn from_request(request: Request, adapter: &Adapter) -> Result<Self, HttpError> {
        match content_type(request.headers()).as_str() {
            JSON => parse_all(request, adapter).await.map(|(parsed, _)| Self::Json(parsed)),
            OCTET_STREAM => {
                let rest = params::from_query(request.uri())?;
                Ok(Self::Bytes(read(request, adapter).await?, rest))
            }
            other => Err(unsupported(other, "application/json or application/octet-stream")),
        }
    }
}

/// A body that holds all of a request: JSON, or bytes.
pub(in crate::http) enum Sent<T> {
    Json { parsed: T, bytes: usize },
    Octets(Bytes),
}

/// Reads a body of either form; parameters beside it would go unheard.
pub(in crate::http) async fn json_or_octets<T: DeserializeOwned + Send + 'static>(
    request: Request,
    adapter: &Adapter,
) -> Result<Sent<T>, HttpError> {
    match content_type(request.headers()).as_str() {
        JSON => {
            let (parsed, bytes) = parse_all(request, adapter).await?;
            Ok(Sent::Json { parsed, bytes })
        }
        OCTET_STREAM => {
            no_query(&request, OCTET_STREAM)?;
            read(request, adapter).await.map(Sent::Octets)
        }
        other => Err(unsupported(other, "application/json or application/octet-stream")),
    }
}

/// The points that a body of bytes is.
pub(in crate::http) fn points_of(body: Bytes) -> Result<PointCloud, ServiceError> {
    PointCloud::from_bytes(body).in_field("body")
}

/// The media type without its parameters, in lower case; empty where none is said.
fn content_type(headers: &HeaderMap) -> String {
    let value = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    value.split(';').next().unwrap_or_default().trim().to_ascii_lowercase()
}

/// Bodies come as they are: what grows when it is read would have to be bounded by what it grows to.
fn as_it_is(headers: &HeaderMap) -> Result<(), HttpError> {
    let encoding =
        headers.get(header::CONTENT_ENCODING).map_or("identity", |value| value.to_str().unwrap_or("?"));
    if encoding.eq_ignore_ascii_case("identity") {
        return Ok(());
    }
    let message = format!("content-encoding must be identity, got {:?}", excerpt(encoding));
    Err(HttpError::from(ServiceError::new(Reason::UnsupportedContentEncoding, message)))
}

fn unsupported(got: &str, supported: &str) -> HttpError {
    let message = format!("content-type must be {supported}, got {:?}", excerpt(got));
    HttpError::from(ServiceError::new(Reason::UnsupportedContentType, message))
}

/// Parses a body that holds the whole request, of so many bytes; parameters beside it would go unheard.
async fn parse_all<T: DeserializeOwned + Send + 'static>(
    request: Request,
    adapter: &Adapter,
) -> Result<(T, usize), HttpError> {
    no_query(&request, JSON)?;
    let arrival = InboundBody::of(request.extensions())?.clone();
    let service = Authorized::of(request.extensions())?.service.clone();
    let body = read(request, adapter).await?;
    let bytes = body.len();
    Ok((parse_beside(&service, body, 0, arrival).await?, bytes))
}

/// Parses JSON that is in memory beside other bytes of its request; it counts with what is made of it.
pub(in crate::http) async fn parse_beside<T: DeserializeOwned + Send + 'static>(
    service: &MapService,
    json: Bytes,
    others: usize,
    arrival: InboundBody,
) -> Result<T, HttpError> {
    arrival.at_least(json.len() * JSON_AND_PARSED + others)?;
    off_runtime(service, json.len(), arrival, move || parse(&json)).await?
}

fn no_query(request: &Request, content_type: &str) -> Result<(), HttpError> {
    let Some(query) = request.uri().query().filter(|query| !query.is_empty()) else { return Ok(()) };
    let message =
        format!("with {content_type} the body holds everything, got the query {:?} too", excerpt(query));
    Err(ServiceError::new(Reason::UnexpectedQuery, message).into())
}

fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, HttpError> {
    let not_json = |error| ServiceError::new(Reason::BadJson, unreadable::body::<T>(body, &error));
    let Object(parsed) = serde_json::from_slice(body).map_err(not_json)?;
    Ok(parsed)
}

/// A body of bytes that are no points: at most `most` of them, which is the limit `limit`.
pub(in crate::http) async fn octets(request: Request, most: usize, limit: &str) -> Result<Bytes, HttpError> {
    match content_type(request.headers()).as_str() {
        OCTET_STREAM => read_most(request, most, limit).await,
        other => Err(unsupported(other, OCTET_STREAM)),
    }
}

pub(in crate::http) async fn read(request: Request, adapter: &Adapter) -> Result<Bytes, HttpError> {
    read_most(request, adapter.message_bytes_max, "message_bytes_max").await
}

async fn read_most(mut request: Request, most: usize, limit: &str) -> Result<Bytes, HttpError> {
    as_it_is(request.headers())?;
    let too_large = |bytes: String| {
        let message = format!("body must be at most {most} bytes ({limit}), got {bytes}");
        HttpError::from(ServiceError::new(Reason::BodyTooLarge, message))
    };
    let declared = request.headers().get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok());
    if let Some(bytes) = declared.and_then(|length| length.parse().ok()).filter(|&bytes: &usize| bytes > most)
    {
        return Err(too_large(bytes.to_string()));
    }
    DefaultBodyLimit::max(most).apply(&mut request);
    Bytes::from_request(request, &()).await.map_err(|rejection| {
        if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
            too_large("more".into())
        } else {
            ServiceError::new(Reason::BodyUnreadable, format!("body: {}", rejection.body_text())).into()
        }
    })
}
