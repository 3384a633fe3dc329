//! Answers that are asked for and never read.

use std::time::Duration;

use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::time::timeout;

use crate::frames::{call, data, message_head, opening};
use crate::siege::{ATTACK, Siege};

const CONNECTIONS: usize = 50;
/// HTTP/2's name for how much of an answer may be on its way.
const INITIAL_WINDOW_SIZE: u16 = 4;

/// Sends as much as the server takes without reading any of what it answers.
async fn send_without_reading(connection: &mut TcpStream, bytes: &[u8]) {
    // What it does not take in this time, it will not.
    let _ = timeout(Duration::from_millis(50), connection.write_all(bytes)).await;
}

#[tokio::test]
async fn answers_over_http_that_nobody_reads() {
    let siege = Siege::begin("answers unread over HTTP").await;
    let requests = "GET /v1/maps/hall/voxels HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(1000);
    let mut unread = Vec::new();
    for _ in 0..CONNECTIONS {
        let mut connection = TcpStream::connect(siege.http()).await.unwrap();
        send_without_reading(&mut connection, requests.as_bytes()).await;
        unread.push(connection);
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}

#[tokio::test]
async fn answers_over_grpc_that_nobody_has_room_for() {
    unread_over_grpc("answers without room over gRPC", 0).await;
}

#[tokio::test]
async fn answers_over_grpc_of_which_a_byte_is_read() {
    unread_over_grpc("answers with room for a byte over gRPC", 1).await;
}

async fn unread_over_grpc(name: &'static str, window: u32) {
    let siege = Siege::begin(name).await;
    // The map's name is the first field of the request.
    let message = [&message_head(false, 6)[..], b"\x0a\x04hall"].concat();
    let calls = (1..200).step_by(2).flat_map(|stream| {
        [call(stream, "/mrol.v1.Mapping/GetTrajectory", &[], 0), data(stream, &message)].concat()
    });
    let calls: Vec<u8> = opening(&[(INITIAL_WINDOW_SIZE, window)]).into_iter().chain(calls).collect();
    let mut unread = Vec::new();
    for _ in 0..CONNECTIONS {
        let mut connection = TcpStream::connect(siege.grpc()).await.unwrap();
        send_without_reading(&mut connection, &calls).await;
        unread.push(connection);
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}
