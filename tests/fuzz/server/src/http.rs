//! HTTP requests: address and body, to a service in this process.

use axum::body::Body;
use axum::http::{Request, StatusCode};
use mrol::http::router;
use serde_json::Value;

use super::hosted::{Answer, Hosted, MESSAGE_BYTES_MAX};

/// Asks for what the input says, and panics where the answer is a defect's, or a refusal changed something.
///
/// An input is a line `METHOD ADDRESS CONTENT-TYPE` and the body; `json` and `bytes` stand for their content types.
pub(super) fn http(bytes: &[u8]) {
    thread_local! {
        static SERVED: Hosted =
            Hosted::new(|middleware| router(middleware, MESSAGE_BYTES_MAX));
    }
    let Some(request) = request(bytes) else { return };
    let changes_maps = ["PUT", "DELETE"].contains(&request.method().as_str());
    SERVED.with(|hosted| {
        let before = hosted.revision();
        let answer = hosted.ask(request);
        match answer.status.is_success() {
            true => hosted.reset(changes_maps),
            false => {
                check_refusal(&answer);
                assert_eq!(hosted.revision(), before, "refused, and the map has changed");
            }
        }
    });
}

fn request(bytes: &[u8]) -> Option<Request<Body>> {
    let end = bytes.iter().position(|&byte| byte == b'\n').unwrap_or(bytes.len());
    let (line, body) = bytes.split_at(end);
    let mut words = std::str::from_utf8(line).ok()?.splitn(3, ' ');
    let request = Request::builder().method(words.next()?).uri(words.next()?);
    let request = match words.next() {
        Some("json") => request.header("content-type", "application/json"),
        Some("bytes") => request.header("content-type", "application/octet-stream"),
        Some(other) => request.header("content-type", other),
        None => request,
    };
    request.body(Body::from(body.get(1..).unwrap_or_default().to_owned())).ok()
}

/// What may come of a request that is right: it was not the time for it.
const NOT_NOW: [StatusCode; 2] = [StatusCode::SERVICE_UNAVAILABLE, StatusCode::GATEWAY_TIMEOUT];

/// A refusal is the caller's fault, or the moment's, and says why.
fn check_refusal(answer: &Answer) {
    let text = String::from_utf8_lossy(&answer.body);
    let expected = answer.status.is_client_error() || NOT_NOW.contains(&answer.status);
    assert!(expected, "{}: {text}", answer.status);
    if !answer.body.is_empty() {
        let error: Value = serde_json::from_slice(&answer.body).expect("an error in JSON");
        for field in ["code", "reason", "detail"] {
            assert!(error[field].as_str().is_some_and(|text| !text.is_empty()), "{field}: {text}");
        }
    }
}
