//! Answers that are asked for and never read.

use std::time::Duration;

use mrol::wire::pb::mapping_client::MappingClient;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::time::timeout;

use crate::frames::{call, data, message_head, opening};
use crate::siege::{ATTACK, BODY_BYTES_MAX, MIB, Siege};
use crate::support::daemon::scan_pb;

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

/// So many voxels a side of a plane that its listing is one piece.
const SIDE: usize = 256;

/// The planes' own memory, connections, and the pieces of listings that are being refused.
const LISTED_BYTES_MAX: usize = 40 * MIB;

#[tokio::test]
async fn listings_over_grpc_of_which_a_byte_is_read() {
    // As much again as bodies may take would lie in memory if pieces on their way did not count.
    let name = "listings with room for a byte over gRPC";
    let siege = Siege::begin_within(name, "", BODY_BYTES_MAX + LISTED_BYTES_MAX).await;
    let side = |i: usize| i as f32 * 0.1 + 0.05;
    let plane: Vec<[f32; 3]> = (0..SIDE * SIDE).map(|i| [side(i / SIDE), side(i % SIDE), 9.05]).collect();
    let mut robot = MappingClient::connect(format!("http://{}", siege.grpc())).await.unwrap();
    robot.insert_scan(scan_pb("hall", "plane", &plane)).await.unwrap();
    let calls = calls_of("/mrol.v1.Occupancy/ListVoxels", 60, 1);
    let mut unread = Vec::new();
    for _ in 0..6 {
        let mut connection = TcpStream::connect(siege.grpc()).await.unwrap();
        send_without_reading(&mut connection, &calls).await;
        unread.push(connection);
    }
    tokio::time::sleep(2 * ATTACK).await;
    siege.end().await;
}

async fn unread_over_grpc(name: &'static str, window: u32) {
    let siege = Siege::begin(name).await;
    let calls = calls_of("/mrol.v1.Mapping/GetTrajectory", 100, window);
    let mut unread = Vec::new();
    for _ in 0..CONNECTIONS {
        let mut connection = TcpStream::connect(siege.grpc()).await.unwrap();
        send_without_reading(&mut connection, &calls).await;
        unread.push(connection);
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}

/// As many calls of `path` for the map, by a client with room for `window` bytes of each answer.
fn calls_of(path: &str, calls: usize, window: u32) -> Vec<u8> {
    // The map's name is the first field of the request.
    let message = [&message_head(false, 6)[..], b"\x0a\x04hall"].concat();
    let streams = (1..).step_by(2).take(calls);
    let calls = streams.flat_map(|stream| [call(stream, path, &[], 0), data(stream, &message)].concat());
    opening(&[(INITIAL_WINDOW_SIZE, window)]).into_iter().chain(calls).collect()
}
