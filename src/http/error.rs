//! Failures as HTTP answers: a status, and a problem document (`application/problem+json`, RFC 9457).
//!
//! `{"title":"Bad Request","status":400,"detail":"...","code":"invalid_argument","reason":"bad_pose"}`. `type` is left
//! out, which by the RFC means that the status says what kind of problem it is; `reason` is the stable word for programs.

use axum::Json;
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;

use crate::access::{HOST_NOT_ALLOWED, KEY_UNKNOWN, Operation};
use crate::admission;
use crate::service::{ErrorCode, ServiceError, Shortage};
use crate::util::excerpt;

/// A failed request.
#[derive(Debug)]
pub(super) struct HttpError {
    status: StatusCode,
    error: ServiceError,
    /// The methods that the route takes, where the request's is none of them.
    allow: Option<String>,
}

/// The media type of a problem document (RFC 9457).
const PROBLEM_JSON: HeaderValue = HeaderValue::from_static("application/problem+json");

/// The status of a failure, and its code as a word.
fn status_of(code: ErrorCode) -> (StatusCode, &'static str) {
    match code {
        ErrorCode::InvalidArgument => (StatusCode::BAD_REQUEST, "invalid_argument"),
        ErrorCode::Unauthenticated => (StatusCode::UNAUTHORIZED, "unauthenticated"),
        ErrorCode::PermissionDenied => (StatusCode::FORBIDDEN, "permission_denied"),
        ErrorCode::NotFound => (StatusCode::NOT_FOUND, "not_found"),
        ErrorCode::Conflict => (StatusCode::CONFLICT, "conflict"),
        ErrorCode::FailedPrecondition => (StatusCode::PRECONDITION_FAILED, "failed_precondition"),
        ErrorCode::ResourceExhausted => (StatusCode::TOO_MANY_REQUESTS, "resource_exhausted"),
        ErrorCode::DeadlineExceeded => (StatusCode::GATEWAY_TIMEOUT, "deadline_exceeded"),
        ErrorCode::Unavailable => (StatusCode::SERVICE_UNAVAILABLE, "unavailable"),
        ErrorCode::Internal => (StatusCode::INTERNAL_SERVER_ERROR, "internal"),
    }
}

impl From<ServiceError> for HttpError {
    fn from(error: ServiceError) -> Self {
        let status = match error.reason {
            HOST_NOT_ALLOWED => StatusCode::MISDIRECTED_REQUEST,
            admission::BODY_STALLED => StatusCode::REQUEST_TIMEOUT,
            Shortage::DISK_FULL => StatusCode::INSUFFICIENT_STORAGE,
            Shortage::MEMORY_FULL => StatusCode::SERVICE_UNAVAILABLE,
            _ => status_of(error.code).0,
        };
        Self { status, error, allow: None }
    }
}

impl HttpError {
    /// A request that is wrong in itself, in a way that HTTP has a status of its own for.
    pub(super) fn with_status(status: StatusCode, reason: &'static str, message: impl Into<String>) -> Self {
        Self { status, error: ServiceError::invalid(reason, message), allow: None }
    }
}

impl IntoResponse for HttpError {
    fn into_response(self) -> Response {
        let ServiceError { code, reason, message, retry_after } = self.error;
        let (_, word) = status_of(code);
        let body = json!({
            "title": self.status.canonical_reason().unwrap_or_default(),
            "status": self.status.as_u16(),
            "detail": message,
            "code": word,
            "reason": reason,
        });
        let mut response = (self.status, Json(body)).into_response();
        response.headers_mut().insert(header::CONTENT_TYPE, PROBLEM_JSON);
        response.extensions_mut().insert(Reason(reason));
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

/// The word of the failure that a response tells; to be found among its extensions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reason(pub(super) &'static str);

impl Reason {
    /// Why the caller was not let in, where that is what `response` says.
    pub(super) fn of_denial(response: &Response) -> Option<&'static str> {
        let denied = matches!(response.status(), StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN);
        response.extensions().get::<Self>().filter(|_| denied).map(|reason| reason.0)
    }
}

/// What an unknown caller is to show (RFC 6750, section 3): there is an error only where something was shown.
fn challenge(reason: &str) -> HeaderValue {
    HeaderValue::from_static(match reason {
        KEY_UNKNOWN | "key_expired" | "key_withdrawn" => "Bearer realm=\"mrol\", error=\"invalid_token\"",
        _ => "Bearer realm=\"mrol\"",
    })
}

/// The answer where no route is.
pub(super) fn no_such_route(request: &Request) -> HttpError {
    let message = format!("no route {}", excerpt(request.uri().path()));
    ServiceError::new(ErrorCode::NotFound, "route_not_found", message).into()
}

/// The answer of a `route` that has other methods.
pub(super) fn no_such_method(request: &Request, route: &str) -> HttpError {
    let mut methods: Vec<_> = Operation::methods_of(route).collect();
    if methods.contains(&"GET") {
        methods.push("HEAD");
    }
    if methods.is_empty() {
        let message = format!("{route} is served without a rule who may ask for it: a defect of the server");
        return ServiceError::new(ErrorCode::Internal, "no_rule", message).into();
    }
    let message = format!("{} does not take {}", excerpt(request.uri().path()), request.method());
    let error = HttpError::with_status(StatusCode::METHOD_NOT_ALLOWED, "method_not_allowed", message);
    HttpError { allow: Some(methods.join(",")), ..error }
}
