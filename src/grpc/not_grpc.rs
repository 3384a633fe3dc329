//! Requests that are no calls: a browser's, above all.

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::{ALLOW, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::Response;

const CALL: &str = "application/grpc";

/// True of a call: POST and of gRPC's own content type, which no page of another site can send unasked.
pub(super) fn is_call(request: &Request) -> bool {
    request.method() == Method::POST && has_calls_type(request.headers())
}

/// The answer to a request that is no call, in HTTP's own words.
pub(super) fn refusal(request: &Request) -> Option<Response> {
    if request.method() != Method::POST {
        let mut answer = says(StatusCode::METHOD_NOT_ALLOWED, "this port speaks gRPC, which is POST alone");
        answer.headers_mut().insert(ALLOW, HeaderValue::from_static("POST"));
        return Some(answer);
    }
    let text = "this port speaks gRPC: content-type must be application/grpc or application/grpc+proto";
    (!has_calls_type(request.headers())).then(|| says(StatusCode::UNSUPPORTED_MEDIA_TYPE, text))
}

/// True of `application/grpc`, alone or with `+` and a format or `;` and parameters behind it. gRPC-web is another
/// protocol, which is not spoken here.
fn has_calls_type(headers: &HeaderMap) -> bool {
    let mut types = headers.get_all(CONTENT_TYPE).iter();
    let is_grpc = |value: &HeaderValue| {
        let (start, rest) = value.as_bytes().split_at_checked(CALL.len())?;
        let ends = rest.first().is_none_or(|c| b"+; ".contains(c));
        (start.eq_ignore_ascii_case(CALL.as_bytes()) && ends).then_some(())
    };
    types.next().is_some_and(|value| is_grpc(value).is_some()) && types.next().is_none()
}

fn says(status: StatusCode, text: &'static str) -> Response {
    let mut answer = Response::new(Body::from(format!("{text}\n")));
    *answer.status_mut() = status;
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static("text/plain; charset=utf-8"));
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_is_told_by_its_content_type() {
        let is_call = |types: &[&'static str]| {
            let types = types.iter().map(|value| (CONTENT_TYPE, HeaderValue::from_static(value)));
            let mut headers = HeaderMap::new();
            for (name, value) in types {
                headers.append(name, value);
            }
            super::has_calls_type(&headers)
        };
        for call in ["application/grpc", "application/grpc+proto", "Application/gRPC; charset=utf-8"] {
            assert!(is_call(&[call]), "{call}");
        }
        for other in ["", "text/plain", "application/grpc-web+proto", "application/json", "application/grp"] {
            assert!(!is_call(&[other]), "{other}");
        }
        assert!(!is_call(&[]) && !is_call(&["application/grpc", "text/plain"]));
    }
}
