//! Keep-outs whose time is up.

use super::{ball, client_of, map, name, names, now_ns, put, started};
use std::time::Duration;

use mrol::map::{KeepOutAct, KeepOutChange};
use mrol::service::{Cause, PutKeepOut, WatchEvent, WatchRequest};
use serde_json::json;

use crate::support::daemon::{Daemon, PATIENCE, json_of, row};

#[tokio::test]
async fn a_keep_out_ends_when_its_time_is_up_by_a_revision_of_its_own() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let watched = WatchRequest::default();
    let mut told = client.watch(&map("a"), watched).await.unwrap();
    let soon =
        PutKeepOut { expires_at_ns: Some(now_ns() + 300_000_000), ..put("spill", ball([0.0; 3], 1.0)) };
    client.put_keep_out(&map("a"), soon).await.unwrap();
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let ended = async {
        loop {
            let message = told.next().await.unwrap().unwrap();
            if let WatchEvent::Change(part) = message.event
                && part.revision == 4
            {
                return part;
            }
        }
    };
    let ended = tokio::time::timeout(PATIENCE, ended).await.unwrap();
    let expired = KeepOutChange { name: name("spill"), act: KeepOutAct::Expired };
    assert_eq!((ended.cause, ended.removed.len()), (Cause::KeepOut(expired), 0));
    assert_eq!(names(&daemon).await, ["dock"]);
    // Nothing else is due.
    assert_eq!(daemon.contents("a").await.0, 4);
}

#[tokio::test]
async fn a_keep_out_whose_time_was_up_while_the_server_was_down_ends_at_its_start() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let at = now_ns() + 400_000_000;
    let soon = PutKeepOut { expires_at_ns: Some(at), ..put("spill", ball([0.0; 3], 1.0)) };
    client.put_keep_out(&map("a"), soon).await.unwrap();
    drop(client);
    let data = daemon.stop().await;
    while now_ns() < at {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let daemon = Daemon::start_in(data, |_| {}).await;
    let query = json!({"points": row(1), "min_revision": 3});
    let answer = json_of(daemon.post("/v1/maps/a/occupancy", query).await).await;
    assert_eq!(answer["revision"], 3, "{answer}");
    assert!(names(&daemon).await.is_empty());
}
