//! Slow loris: what comes, comes a byte at a time.

use std::iter::{once, repeat_n};
use std::net::SocketAddr;
use std::time::Duration;

use tokio::task::JoinSet;

use crate::frames::{
    CONTINUATION, Connection, DATA, HEADERS, call, call_headers, frame, message_head, opening, was_answered,
};
use crate::siege::{MESSAGE_BYTES_MAX, Siege};

const CONNECTIONS: usize = 100;
/// Between two bytes: a body is never silent for as long as others would wait for it.
const PAUSE: Duration = Duration::from_millis(100);
/// More than the server should have patience for.
const BYTES: usize = 400;

/// Sends the first piece at once and the others slowly, over many connections; what the server said to each.
async fn dribble(server: SocketAddr, first: Vec<u8>, then: Vec<u8>) -> Vec<Vec<u8>> {
    let mut attackers = JoinSet::new();
    for _ in 0..CONNECTIONS {
        let pieces = once(first.clone()).chain(repeat_n(then.clone(), BYTES));
        let connection = Connection::open_raw(server).await;
        attackers.spawn(connection.dribble(pieces, PAUSE));
    }
    attackers.join_all().await
}

#[tokio::test]
async fn headers_over_http_that_do_not_end() {
    let siege = Siege::begin("headers dribbled over HTTP/1").await;
    dribble(siege.http(), b"GET /v1/maps HTTP/1.1\r\nhost: localhost\r\nx-slow: ".to_vec(), b"a".to_vec())
        .await;
    siege.end().await;
}

#[tokio::test]
async fn headers_over_grpc_that_do_not_end() {
    let siege = Siege::begin("headers dribbled over HTTP/2").await;
    let begun = frame(HEADERS, 0, 1, &call_headers("/mrol.v1.Occupancy/QueryPoints", &[]));
    dribble(siege.grpc(), [opening(&[]), begun].concat(), frame(CONTINUATION, 0, 1, b"")).await;
    siege.end().await;
}

#[tokio::test]
async fn bodies_over_http_that_do_not_end() {
    let siege = Siege::begin("bodies dribbled over HTTP").await;
    let head = format!(
        "POST /v1/maps/hall/occupancy HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/octet-stream\r\n\
         content-length: {MESSAGE_BYTES_MAX}\r\n\r\n"
    );
    for answer in dribble(siege.http(), head.into_bytes(), vec![0]).await {
        let answer = String::from_utf8_lossy(&answer);
        assert!(
            answer.starts_with("HTTP/1.1 408") && answer.contains("body_bytes_per_s_min is 1024"),
            "{answer}"
        );
    }
    siege.end().await;
}

#[tokio::test]
async fn messages_over_grpc_that_do_not_end() {
    let siege = Siege::begin("messages dribbled over gRPC").await;
    let head = call(1, "/mrol.v1.Occupancy/QueryPoints", &[], 0);
    let message = frame(DATA, 0, 1, &message_head(false, MESSAGE_BYTES_MAX as u32));
    let first = [opening(&[]), head, message].concat();
    for answer in dribble(siege.grpc(), first, frame(DATA, 0, 1, b"\0")).await {
        assert!(was_answered(&answer, 1), "{answer:?}");
    }
    siege.end().await;
}
