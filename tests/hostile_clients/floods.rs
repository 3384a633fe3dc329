//! Frames that cost their sender nothing, as many as go out.

use tokio::task::JoinSet;

use crate::frames::{
    CONTINUATION, Connection, DATA, HEADERS, PING, PRIORITY, RST_STREAM, SETTINGS, WINDOW_UPDATE, call,
    call_headers, frame,
};
use crate::siege::{ATTACK, Siege};

const CONNECTIONS: usize = 8;
/// Frames that go out at once.
const AT_ONCE: usize = 200;
const QUERY: &str = "/mrol.v1.Occupancy/QueryPoints";
const CANCEL: [u8; 4] = 8u32.to_be_bytes();

/// Sends `opening` once and then what `flood` makes of the number of the round, as fast as it goes; whoever is
/// disconnected comes again.
async fn flood(siege: &Siege, opening: Vec<u8>, flood: impl Fn(u32) -> Vec<u8> + Copy + Send + 'static) {
    let mut attackers = JoinSet::new();
    for server in [siege.grpc(), siege.http()].into_iter().cycle().take(CONNECTIONS) {
        let opening = opening.clone();
        attackers.spawn(async move {
            loop {
                let mut connection = Connection::open(server).await;
                connection.send(&opening).await;
                for round in 0.. {
                    if !connection.send(&flood(round)).await {
                        break;
                    }
                    tokio::task::yield_now().await;
                }
            }
        });
    }
    tokio::time::sleep(ATTACK).await;
}

/// The number of the `i`th stream of a round.
fn stream(round: u32, i: usize) -> u32 {
    (round * AT_ONCE as u32 + i as u32) * 2 + 1
}

#[tokio::test]
async fn rapid_reset() {
    let siege = Siege::begin_alone("rapid reset").await;
    let reset = |round| {
        let calls = (0..AT_ONCE).map(|i| stream(round, i));
        calls.flat_map(|s| [call(s, QUERY, &[], 0), frame(RST_STREAM, 0, s, &CANCEL)].concat()).collect()
    };
    flood(&siege, Vec::new(), reset).await;
    siege.end().await;
}

#[tokio::test]
async fn calls_that_reset_themselves_by_an_error() {
    let siege = Siege::begin_alone("resets by errors").await;
    // A window that grows by nothing is an error of its stream.
    let reset = |round| {
        let calls = (0..AT_ONCE).map(|i| stream(round, i));
        calls.flat_map(|s| [call(s, QUERY, &[], 0), frame(WINDOW_UPDATE, 0, s, &[0; 4])].concat()).collect()
    };
    flood(&siege, Vec::new(), reset).await;
    siege.end().await;
}

#[tokio::test]
async fn continuation_flood() {
    let siege = Siege::begin_alone("continuation flood").await;
    let begun = frame(HEADERS, 0, 1, &call_headers(QUERY, &[]));
    let more = |_| {
        let piece = crate::frames::literal("x-more", &"a".repeat(1000));
        frame(CONTINUATION, 0, 1, &piece.repeat(16)).repeat(4)
    };
    flood(&siege, begun, more).await;
    siege.end().await;
}

#[tokio::test]
async fn frames_that_ask_for_nothing() {
    for (name, kind, stream, payload) in [
        ("ping flood", PING, 0, vec![0; 8]),
        ("settings flood", SETTINGS, 0, Vec::new()),
        ("window updates", WINDOW_UPDATE, 0, 1u32.to_be_bytes().to_vec()),
        ("priorities", PRIORITY, 1, vec![0, 0, 0, 0, 1]),
        ("empty continuations", CONTINUATION, 1, Vec::new()),
        ("empty data", DATA, 1, Vec::new()),
    ] {
        let siege = Siege::begin_alone(name).await;
        let begun = match kind {
            CONTINUATION => frame(HEADERS, 0, 1, &call_headers(QUERY, &[])),
            DATA => call(1, QUERY, &[], 0),
            _ => Vec::new(),
        };
        let frames: &'static [u8] = frame(kind, 0, stream, &payload).repeat(AT_ONCE).leak();
        flood(&siege, begun, |_| frames.to_vec()).await;
        siege.end().await;
    }
}
