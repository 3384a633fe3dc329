//! Much that is declared, and never sent.

use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::task::JoinSet;

use crate::frames::{Connection, DATA, call, frame, message_head, was_answered};
use crate::siege::{MESSAGE_BYTES_MAX, Siege};

const CONNECTIONS: usize = 200;

/// What is sent of a body: every other client sends a byte.
fn sent(client: usize) -> &'static [u8] {
    if client.is_multiple_of(2) { b"" } else { b"\0" }
}

#[tokio::test]
async fn bodies_of_32_mib_over_http_that_never_come() {
    let siege = Siege::begin("32 MiB declared over HTTP by 200").await;
    let mut attackers = JoinSet::new();
    for client in 0..CONNECTIONS {
        let mut connection = Connection::open_raw(siege.http()).await;
        let head = format!(
            "POST /v1/maps/hall/occupancy HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/octet-stream\r\n\
             content-length: {MESSAGE_BYTES_MAX}\r\n\r\n"
        );
        assert!(connection.send(&[head.as_bytes(), sent(client)].concat()).await);
        attackers.spawn(connection.closed());
    }
    for answer in attackers.join_all().await {
        let answer = String::from_utf8_lossy(&answer);
        assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("body_silence_max is 2s"), "{answer}");
    }
    siege.end().await;
}

#[tokio::test]
async fn messages_of_32_mib_over_grpc_that_never_come() {
    let siege = Siege::begin("32 MiB declared over gRPC by 200").await;
    let mut attackers = JoinSet::new();
    for client in 0..CONNECTIONS {
        let mut connection = Connection::open(siege.grpc()).await;
        let message = [&message_head(false, MESSAGE_BYTES_MAX as u32), sent(client)].concat();
        let head = call(1, "/mrol.v1.Occupancy/QueryPoints", &[], 0);
        assert!(connection.send(&[head, frame(DATA, 0, 1, &message)].concat()).await);
        attackers.spawn(connection.closed());
    }
    for answer in attackers.join_all().await {
        assert!(was_answered(&answer, 1), "{answer:?}");
    }
    siege.end().await;
}

#[tokio::test]
async fn bodies_that_are_abandoned_as_soon_as_they_are_declared() {
    let siege = Siege::begin("bodies abandoned at once").await;
    for _ in 0..10 * CONNECTIONS {
        let mut connection = TcpStream::connect(siege.http()).await.unwrap();
        let head = format!(
            "PUT /v1/maps/hall/snapshot HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/octet-stream\r\n\
             content-length: {MESSAGE_BYTES_MAX}\r\n\r\n"
        );
        connection.write_all(head.as_bytes()).await.unwrap();
    }
    siege.end().await;
}
