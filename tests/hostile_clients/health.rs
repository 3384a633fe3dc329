//! What needs no key: health checks that do not end, and those that take the place of others.

use std::time::Duration;

use mrol::wire::pb::occupancy_client::OccupancyClient;
use tokio::task::JoinSet;

use crate::frames::{Connection, DATA, call, data, frame, is_answered, message_head, opening, was_answered};
use crate::siege::{ATTACK, MIB, Siege};
use crate::support::daemon::{query_pb, row};

const CHECK: &str = "/grpc.health.v1.Health/Check";
const WATCH: &str = "/grpc.health.v1.Health/Watch";
const CONNECTIONS: usize = 8;
/// Calls of one connection: a few fewer than it may have.
const CALLS: usize = 120;
/// HTTP/2's name for how much of an answer may be on its way.
const INITIAL_WINDOW_SIZE: u16 = 4;
/// A health check's empty message, and its end.
fn message(stream: u32) -> Vec<u8> {
    data(stream, &message_head(false, 0))
}

fn streams(calls: usize) -> impl Iterator<Item = u32> {
    (1..).step_by(2).take(calls)
}

#[tokio::test]
async fn checks_whose_bodies_do_not_end() {
    // Of each a MiB but for its last byte, so that none ever ends.
    const BODY_BYTES: usize = MIB - 1;
    const WITHOUT_BOUND: usize = CONNECTIONS * CALLS * BODY_BYTES;
    // What is taken of them is the bodies of `probes_max`, of 1 KiB each, and what connections hold.
    const BOUND: usize = 32 * MIB;
    const { assert!(WITHOUT_BOUND > 28 * BOUND) };
    let siege = Siege::begin_within("health checks that do not end", "", BOUND).await;
    let mut attackers = JoinSet::new();
    for _ in 0..CONNECTIONS {
        let mut connection = Connection::open(siege.grpc()).await;
        attackers.spawn(async move {
            for stream in streams(CALLS) {
                let body = [message_head(false, MIB as u32), vec![0; BODY_BYTES]].concat();
                let pieces = body.chunks(16 << 10).map(|piece| frame(DATA, 0, stream, piece));
                let call = [call(stream, CHECK, &[], 0), pieces.flatten().collect()].concat();
                if !connection.send(&call).await {
                    break;
                }
            }
            connection
        });
    }
    let _held = attackers.join_all().await;
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}

#[tokio::test]
async fn a_check_that_never_comes_ends_with_its_connection() {
    let siege =
        Siege::begin_within("health checks that never come", "probe_time_max_s = 1.0\n", 64 * MIB).await;
    let mut attackers = JoinSet::new();
    for _ in 0..CONNECTIONS {
        let mut connection = Connection::open(siege.grpc()).await;
        assert!(connection.send(&call(1, CHECK, &[], 0)).await);
        attackers.spawn(connection.closed());
    }
    for answer in attackers.join_all().await {
        assert!(was_answered(&answer, 1), "{answer:?}");
    }
    siege.end().await;
}

#[tokio::test]
async fn watches_leave_streams_to_those_who_work() {
    let siege = Siege::begin_within("health watches", "health_watch_max_s = 2.0\n", 64 * MIB).await;
    let mut watching = Vec::new();
    // More of one connection than it may have, and more connections than there are places.
    for _ in 0..3 * CONNECTIONS {
        let mut connection = Connection::open(siege.grpc()).await;
        for stream in streams(20) {
            connection.send(&[call(stream, WATCH, &[], 0), message(stream)].concat()).await;
        }
        watching.push(connection);
    }
    for connection in &mut watching {
        connection.until(|answers| is_answered(answers, 1)).await;
    }
    let mut planner = OccupancyClient::connect(format!("http://{}", siege.grpc())).await.unwrap();
    let questions = tokio_stream::iter([query_pb("hall", &row(10))]);
    let mut answers = planner.query_points_stream(questions).await.unwrap().into_inner();
    assert!(answers.message().await.unwrap().is_some());
    drop(answers);
    // The watches that were let in are ended, and then their connections, which nobody uses.
    for connection in watching {
        let answer = connection.closed().await;
        assert!(was_answered(&answer, 1) && was_answered(&answer, 3));
    }
    siege.end().await;
}

#[tokio::test]
async fn connections_in_use_leave_some_to_health() {
    // More than there are, each with a refusal that nobody has room for: none of them counts as a request.
    let siege = Siege::begin("connections that are all in use").await;
    let mut held = Vec::new();
    let calls = (1..20).step_by(2).flat_map(|stream| call(stream, "/mrol.v1.Maps/NoSuchCall", &[], 1));
    let calls: Vec<u8> = opening(&[(INITIAL_WINDOW_SIZE, 0)]).into_iter().chain(calls).collect();
    for server in [siege.http(), siege.grpc()].into_iter().cycle().take(2 * 700) {
        let mut connection = Connection::open_raw(server).await;
        connection.send(&calls).await;
        held.push(connection);
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}
