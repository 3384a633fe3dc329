//! Little that becomes much when it is read.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use tokio::task::JoinSet;

use crate::frames::{Connection, call, data, message_head};
use crate::siege::{ATTACK, MESSAGE_BYTES_MAX, MIB, Siege};
use crate::support::daemon::client;

const QUERY: &str = "/mrol.v1.Occupancy/QueryPoints";
const CONNECTIONS: usize = 8;

/// Zeros of a few times what a message may be, by gzip: a thousandth of that.
fn gzip(bytes: usize) -> Vec<u8> {
    gzip_of(&vec![0; bytes])
}

fn gzip_of(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zstd(bytes: usize) -> Vec<u8> {
    zstd::bulk::compress(&vec![0; bytes], 19).unwrap()
}

/// Sends the same message again and again over several connections.
async fn bombard(siege: &Siege, path: &'static str, encoding: &'static str, bomb: Vec<u8>) {
    let message = [message_head(true, bomb.len() as u32), bomb].concat();
    let mut attackers = JoinSet::new();
    for _ in 0..CONNECTIONS {
        let (server, message) = (siege.grpc(), message.clone());
        attackers.spawn(async move {
            let mut connection = Connection::open(server).await;
            for stream in (1..).step_by(2) {
                let head = call(stream, path, &[("grpc-encoding", encoding)], 0);
                if !connection.send(&[head, data(stream, &message)].concat()).await {
                    connection = Connection::open(server).await;
                }
                tokio::task::yield_now().await;
            }
        });
    }
    tokio::time::sleep(ATTACK).await;
}

#[tokio::test]
async fn gzip_messages_that_grow_beyond_the_limit() {
    let siege = Siege::begin_alone("gzip bombs over gRPC").await;
    bombard(&siege, QUERY, "gzip", gzip(MESSAGE_BYTES_MAX + 16 * MIB)).await;
    siege.end().await;
}

#[tokio::test]
async fn zstd_messages_that_grow_beyond_the_limit() {
    let siege = Siege::begin_alone("zstd bombs over gRPC").await;
    bombard(&siege, QUERY, "zstd", zstd(1024 * MIB)).await;
    siege.end().await;
}

/// Four million regions without a shape, and as many links without a part: two bytes each, and a hundred in memory.
#[tokio::test]
async fn messages_whose_lists_grow_when_they_are_decoded() {
    // A few messages of each kind, which have 8 MiB, and not what they would be: half a gigabyte each.
    let siege = Siege::begin_within("lists of nothing over gRPC", "", 256 * MIB).await;
    let ignored = [4 << 3 | 2, 0].repeat(4 * MIB);
    bombard(&siege, "/mrol.v1.Occupancy/CheckPoses", "gzip", gzip_of(&ignored)).await;
    let links = [1 << 3 | 2, 0].repeat(4 * MIB);
    let head = [&[2 << 3 | 2][..], &varint(links.len())].concat();
    let body = [head, links].concat();
    bombard(&siege, "/mrol.v1.Occupancy/CheckMotionsStream", "gzip", gzip_of(&body)).await;
    siege.end().await;
}

/// A length as protobuf writes it.
fn varint(mut length: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while length > 0x7f {
        bytes.push(length as u8 | 0x80);
        length >>= 7;
    }
    bytes.push(length as u8);
    bytes
}

#[tokio::test]
async fn compressed_bodies_over_http_are_refused() {
    let siege = Siege::begin_alone("bombs over HTTP").await;
    for (encoding, bomb) in [("gzip", gzip(64 * MIB)), ("zstd", zstd(64 * MIB))] {
        for _ in 0..100 {
            let url = format!("http://{}/v1/maps/hall/occupancy", siege.http());
            let post = client().post(url).header("content-encoding", encoding);
            let post = post.header("content-type", "application/octet-stream").body(bomb.clone());
            let answer = post.send().await.unwrap();
            assert_eq!(answer.status(), 415);
            assert!(answer.text().await.unwrap().contains("content-encoding must be identity"));
        }
    }
    siege.end().await;
}
