//! Bad input: a clear error that names field, value and limit, and a map that did not change.

mod frames;
mod routes;
mod values;

use reqwest::StatusCode;
use serde_json::Value;
use tonic::{Code, Status};

use crate::support::daemon::{Daemon, json_of, row};

/// A server with a map `a` of ten voxels and room for 100 points a request.
pub(crate) async fn daemon() -> Daemon {
    let daemon = Daemon::start_with(|config| {
        config.limits.points_per_request_max = 100;
        config.limits.keys_per_request_max = 100;
        config.limits.message_bytes_max = 20_000;
    });
    let daemon = daemon.await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    daemon
}

pub(crate) async fn assert_unchanged(daemon: &Daemon) {
    let expected: Vec<[i64; 3]> = (0..10).map(|i| [i, 0, 0]).collect();
    assert_eq!(daemon.contents("a").await, (1, expected));
}

/// The message holds each of the words.
#[track_caller]
pub(crate) fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "{word:?} is not in {message:?}");
    }
}

/// The error is a 400 whose message holds the words.
#[track_caller]
pub(crate) fn assert_refused((status, error): (StatusCode, Value), words: &[&str]) {
    assert_eq!(status, StatusCode::BAD_REQUEST, "{error}");
    assert_eq!(error["code"], "invalid_argument");
    assert_says(error["detail"].as_str().unwrap_or_default(), words);
}

#[track_caller]
pub(crate) fn assert_invalid(status: &Status, words: &[&str]) {
    assert_eq!(status.code(), Code::InvalidArgument, "{status}");
    assert!(status.metadata().contains_key("mrol-reason"));
    assert_says(status.message(), words);
}

pub(crate) async fn refused(answer: reqwest::Response) -> (StatusCode, Value) {
    (answer.status(), json_of(answer).await)
}
