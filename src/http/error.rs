//! Failures as HTTP answers: a status, and a problem document (`application/problem+json`, RFC 9457).
//!
//! `{"title":"Bad Request","status":400,"detail":"...","code":"invalid_argument","reason":"bad_pose"}`. `type` is left
//! out, which by the RFC means that the status says what kind of problem it is; `reason` is the stable word for
//! programs.

use axum::Json;
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::access::Operation;
use mrol_map::util::excerpt;
use mrol_service::{ErrorCode, MapHolder, Reason, ServiceError};

/// A failed request.
#[derive(Debug)]
pub(super) struct HttpError {
    status: StatusCode,
    error: ServiceError,
    /// The methods that the route takes, where the request's is none of them.
    allow: Option<String>,
}

/// A failed request (RFC 9457).
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Problem {
    /// The words of the status.
    title: &'static str,
    /// The status.
    status: u16,
    /// What was wrong, with field, value and limit.
    detail: String,
    /// The kind of failure.
    code: &'static str,
    /// Why it failed: a stable word for programs.
    reason: &'static str,
    /// The nodes that hold the map, where this one does not: the first is the best.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    elsewhere: Vec<Holder>,
}

/// A node of a cluster that holds a map.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Holder {
    /// The name of the node.
    node: String,
    /// Address of its HTTP.
    http: String,
    /// Address of its gRPC.
    grpc: String,
}

impl From<MapHolder> for Holder {
    fn from(MapHolder { node, http, grpc }: MapHolder) -> Self {
        Self { node, http, grpc }
    }
}

/// Address of HTTP to which an answer sends the caller on.
#[derive(Debug, Clone)]
struct SentOnTo(String);

impl Problem {
    fn of(status: StatusCode, ServiceError { reason, message, holders, .. }: ServiceError) -> Self {
        Self {
            title: status.canonical_reason().unwrap_or_default(),
            status: status.as_u16(),
            detail: message,
            code: reason.code().as_str(),
            reason: reason.as_str(),
            elsewhere: holders.into_iter().map(Into::into).collect(),
        }
    }
}

/// The document by itself, for answers that have begun.
impl From<ServiceError> for Problem {
    fn from(error: ServiceError) -> Self {
        Self::of(status_of(error.reason), error)
    }
}

/// The media type of a problem document (RFC 9457).
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// The status of a failure for this reason.
pub(super) fn status_of(reason: Reason) -> StatusCode {
    let precise = reason.http_status().and_then(|status| StatusCode::from_u16(status).ok());
    precise.unwrap_or_else(|| status_of_code(reason.code()))
}

/// The status of a kind of failure.
fn status_of_code(code: ErrorCode) -> StatusCode {
    match code {
        ErrorCode::InvalidArgument => StatusCode::BAD_REQUEST,
        ErrorCode::Unauthenticated => StatusCode::UNAUTHORIZED,
        ErrorCode::PermissionDenied => StatusCode::FORBIDDEN,
        ErrorCode::NotFound => StatusCode::NOT_FOUND,
        ErrorCode::Conflict => StatusCode::CONFLICT,
        ErrorCode::FailedPrecondition => StatusCode::PRECONDITION_FAILED,
        ErrorCode::ResourceExhausted => StatusCode::TOO_MANY_REQUESTS,
        ErrorCode::DeadlineExceeded => StatusCode::GATEWAY_TIMEOUT,
        ErrorCode::Unavailable => StatusCode::SERVICE_UNAVAILABLE,
        ErrorCode::Internal => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

impl From<ServiceError> for HttpError {
    fn from(error: ServiceError) -> Self {
        let status = match status_of(error.reason) {
            // Nobody can be sent on to an address that is not known.
            StatusCode::TEMPORARY_REDIRECT if error.holders.is_empty() => status_of_code(error.code()),
            status => status,
        };
        Self { status, error, allow: None }
    }
}

impl IntoResponse for HttpError {
    fn into_response(self) -> Response {
        let (reason, retry_after) = (self.error.reason, self.error.retry_after);
        let code = reason.code();
        let sent_on_to = self.error.holders.first().map(|holder| SentOnTo(holder.http.clone()));
        let mut response = (self.status, Json(Problem::of(self.status, self.error))).into_response();
        response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        response.extensions_mut().insert(reason);
        if let Some(address) = sent_on_to {
            response.extensions_mut().insert(address);
        }
        let headers = response.headers_mut();
        if let Some(wait) = retry_after {
            headers.insert(header::RETRY_AFTER, (wait.as_secs_f64().ceil() as u64).into());
        }
        if code == ErrorCode::Unauthenticated {
            headers.insert(header::WWW_AUTHENTICATE, challenge(reason));
        }
        if let Some(allow) = self.allow.and_then(|methods| methods.parse().ok()) {
            headers.insert(header::ALLOW, allow);
        }
        response
    }
}

/// Names, in an answer to a request for `uri` that sends the caller on, the same path and query at the other address.
pub(super) fn locate(response: &mut Response, uri: &Uri) {
    let Some(SentOnTo(address)) = response.extensions().get::<SentOnTo>() else { return };
    let path = uri.path_and_query().map_or("/", |path| path.as_str());
    if let Ok(location) = HeaderValue::try_from(format!("{address}{path}")) {
        response.headers_mut().insert(header::LOCATION, location);
    }
}

/// Why the caller was not let in, where that is what `response` says.
pub(super) fn denial(response: &Response) -> Option<&'static str> {
    let reason = response.extensions().get::<Reason>()?;
    let is_denied = matches!(reason.code(), ErrorCode::Unauthenticated | ErrorCode::PermissionDenied);
    is_denied.then_some(reason.as_str())
}

/// What an unknown caller is to show (RFC 6750, section 3): there is an error only where something was shown.
fn challenge(reason: Reason) -> HeaderValue {
    HeaderValue::from_static(match reason {
        Reason::KeyUnknown | Reason::KeyExpired | Reason::KeyWithdrawn => {
            "Bearer realm=\"mrol\", error=\"invalid_token\""
        }
        _ => "Bearer realm=\"mrol\"",
    })
}

/// The answer where no route is.
pub(super) fn no_such_route(request: &Request) -> HttpError {
    let message = format!("no route {}", excerpt(request.uri().path()));
    ServiceError::new(Reason::RouteNotFound, message).into()
}

/// The answer of a `route` that has other methods.
pub(super) fn no_such_method(request: &Request, route: &str) -> HttpError {
    let mut methods: Vec<_> = Operation::methods_of(route).collect();
    if methods.contains(&"GET") {
        methods.push("HEAD");
    }
    if methods.is_empty() {
        let message = format!("{route} is served without a rule who may ask for it: a defect of the server");
        return ServiceError::new(Reason::NoRule, message).into();
    }
    let message = format!("{} does not take {}", excerpt(request.uri().path()), request.method());
    let error = HttpError::from(ServiceError::new(Reason::MethodNotAllowed, message));
    HttpError { allow: Some(methods.join(",")), ..error }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::MapName;

    fn answered(holders: &[&str]) -> Response {
        let holder = |at: &&str| MapHolder {
            node: "b".to_owned(),
            http: format!("http://{at}:7333"),
            grpc: format!("http://{at}:7334"),
        };
        let map = MapName::new("hall").unwrap();
        let error = ServiceError::map_elsewhere(&map, holders.iter().map(holder).collect());
        let mut response = HttpError::from(error).into_response();
        let uri = "http://a:7333/v1/maps/hall/voxels?level=1&limit=2".parse().unwrap();
        locate(&mut response, &uri);
        response
    }

    #[test]
    fn who_is_sent_on_is_sent_to_the_same_path_and_query() {
        let response = answered(&["b", "c"]);
        assert_eq!(response.status(), 307);
        let location = response.headers().get(header::LOCATION).unwrap();
        assert_eq!(location, "http://b:7333/v1/maps/hall/voxels?level=1&limit=2");
    }

    #[test]
    fn where_nobody_is_known_nobody_is_sent_on() {
        let response = answered(&[]);
        assert_eq!(
            (response.status(), response.headers().get(header::LOCATION)),
            (StatusCode::SERVICE_UNAVAILABLE, None)
        );
    }
}
