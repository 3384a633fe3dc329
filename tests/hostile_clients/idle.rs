//! Connections that do nothing, more than there are places for.

use std::time::Duration;

use mrol::wire::transport::FRAME_BYTES_MAX;
use tokio::time::timeout;

use crate::frames::{ACK, Connection, HEADERS, SETTINGS, frame};
use crate::siege::{ATTACK, Siege};

const CONNECTIONS: usize = 1000;
/// At most, for the server's settings to come, which say how large a frame may be.
const SETTLED: Duration = Duration::from_millis(500);

#[tokio::test]
async fn connections_that_hold_most_of_a_frame() {
    let siege = Siege::begin("1000 frames that do not end, twice").await;
    let mut begun = Vec::new();
    for _ in 0..CONNECTIONS {
        begun.push(Connection::open(siege.http()).await);
        begun.push(Connection::open(siege.grpc()).await);
    }
    let all_heard = async {
        for connection in &mut begun {
            connection.until(|said| !said.is_empty()).await;
        }
    };
    // Those that nobody accepts hear nothing.
    let _ = timeout(SETTLED, all_heard).await;
    let mut most = frame(HEADERS, 0, 1, &vec![0; FRAME_BYTES_MAX as usize]);
    most.pop();
    let settled = frame(SETTINGS, ACK, 0, &[]);
    for connection in &mut begun {
        connection.send(&[&settled[..], &most].concat()).await;
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}

#[tokio::test]
async fn a_thousand_idle_connections_of_each_protocol() {
    let siege = Siege::begin("1000 idle connections, twice").await;
    let mut idle = Vec::new();
    for _ in 0..CONNECTIONS {
        idle.push(Connection::open_raw(siege.http()).await);
        idle.push(Connection::open(siege.grpc()).await);
    }
    tokio::time::sleep(ATTACK).await;
    siege.end().await;
}

#[tokio::test]
async fn connections_that_come_and_go() {
    let siege = Siege::begin("connections opened and closed").await;
    for _ in 0..CONNECTIONS {
        drop(Connection::open_raw(siege.http()).await);
        drop(Connection::open(siege.grpc()).await);
    }
    siege.end().await;
}
