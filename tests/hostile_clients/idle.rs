//! Connections that do nothing, more than there are places for.

use crate::frames::Connection;
use crate::siege::{ATTACK, Siege};

const CONNECTIONS: usize = 1000;

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
