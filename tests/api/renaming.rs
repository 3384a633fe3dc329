//! Maps that get another name: over both protocols, with those who hold them.

use mrol::client::{Client, NewMap, Replica, ReplicaOptions};
use mrol::map::MapName;
use mrol::service::{Reason, WatchRequest};
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, json_of, query_pb, row, wait_until};

fn map(name: &str) -> MapName {
    MapName::new(name).unwrap()
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

async fn names(daemon: &Daemon) -> Vec<String> {
    let listed = json_of(daemon.get("/v1/maps").await).await;
    listed["maps"].as_array().unwrap().iter().map(|map| map["map"].as_str().unwrap().to_owned()).collect()
}

async fn refused(daemon: &Daemon, path: &str, to: &str) -> (StatusCode, String, String) {
    let answer = daemon.post(path, json!({ "to": to })).await;
    let (status, body) = (answer.status(), json_of(answer).await);
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    (status, text(&body["reason"]), text(&body["detail"]))
}

#[tokio::test]
async fn a_map_keeps_all_but_its_name_here_and_after_a_restart() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let before = json_of(daemon.get("/v1/maps/a").await).await;
    let answer = daemon.post("/v1/maps/a/rename", json!({"to": "b"})).await;
    assert_eq!(answer.status(), StatusCode::OK);
    let renamed = json_of(answer).await;
    assert_eq!(renamed["map"], "b");
    for field in ["map_uuid", "revision", "content_hash", "settings", "scans", "robots", "levels"] {
        assert_eq!(renamed[field], before[field], "{field}");
    }
    // Where its robots were last seen is known in memory alone.
    let now = json_of(daemon.get("/v1/maps/b").await).await;
    assert!(!before["sightings"].as_array().unwrap().is_empty(), "{before}");
    assert_eq!(now["sightings"], before["sightings"]);
    assert_eq!(daemon.get("/v1/maps/a").await.status(), StatusCode::NOT_FOUND);
    // The former name is free, and the map takes changes, undo among them.
    daemon.make_map("a").await;
    daemon.put_in("b", &row(5)).await;
    let undone = daemon.post("/v1/maps/b/undo", json!({"revision": 1})).await;
    assert_eq!(undone.status(), StatusCode::OK, "{}", undone.text().await.unwrap());
    let (revision, voxels) = daemon.contents("b").await;
    let data = daemon.stop().await;
    let daemon = Daemon::start_in(data, |_| ()).await;
    assert_eq!(names(&daemon).await, ["a", "b"]);
    assert_eq!(daemon.contents("b").await, (revision, voxels));
    assert_eq!(json_of(daemon.get("/v1/maps/b").await).await["map_uuid"], before["map_uuid"]);
}

#[tokio::test]
async fn a_map_in_memory_alone_is_renamed_over_grpc() {
    let daemon = Daemon::start_with(|config| config.data_dir = Default::default()).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let request = pb::RenameMapRequest { map: "a".into(), to: "b".into() };
    let renamed = daemon.maps().await.rename_map(request).await.unwrap().into_inner().map.unwrap();
    assert_eq!((renamed.map.as_str(), renamed.version.unwrap().revision), ("b", 1));
    assert_eq!(names(&daemon).await, ["b"]);
}

#[tokio::test]
async fn a_name_that_is_taken_or_none_is_refused_and_nothing_is_changed() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.make_map("b").await;
    for taken in ["a", "b"] {
        let (status, reason, message) = refused(&daemon, "/v1/maps/a/rename", taken).await;
        assert_eq!((status, reason.as_str()), (StatusCode::CONFLICT, "map_exists"));
        assert!(
            message.starts_with("to must be a name that no map has") && message.contains(taken),
            "{message}"
        );
    }
    for bad in ["", "B", "../b", &"b".repeat(65)] {
        let (status, reason, message) = refused(&daemon, "/v1/maps/a/rename", bad).await;
        assert_eq!((status, reason.as_str()), (StatusCode::BAD_REQUEST, "bad_name"), "{bad}");
        assert!(message.starts_with("to: ") && message.contains("[a-z0-9][a-z0-9_-]{0,63}"), "{message}");
        let request = pb::RenameMapRequest { map: "a".into(), to: bad.into() };
        let status = daemon.maps().await.rename_map(request).await.unwrap_err();
        assert!(status.code() == Code::InvalidArgument && status.message().starts_with("to: "), "{status}");
    }
    let (status, reason, _) = refused(&daemon, "/v1/maps/absent/rename", "c").await;
    assert_eq!((status, reason.as_str()), (StatusCode::NOT_FOUND, "map_not_found"));
    assert_eq!(names(&daemon).await, ["a", "b"]);
}

#[tokio::test]
async fn who_watches_is_told_that_the_map_was_renamed() {
    let daemon = Daemon::start().await;
    let client = client_of(&daemon).await;
    let (info, _) = client.create_map(&map("a"), NewMap::of(0.1)).await.unwrap();
    let mut watched = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    assert!(watched.next().await.unwrap().is_ok());
    let mut events = daemon.get("/v1/maps/a/events/watch").await;
    assert_eq!(events.status(), StatusCode::OK);
    let replica = Replica::open(client.clone(), map("a"), ReplicaOptions::default()).await.unwrap();
    let renamed = client.rename_map(&map("a"), &map("b")).await.unwrap();
    assert_eq!(renamed.version.map_uuid, info.version.map_uuid);
    let ended = loop {
        match watched.next().await.unwrap() {
            Ok(_) => {}
            Err(error) => break error.to_string(),
        }
    };
    assert!(ended.contains("map a was renamed: list the maps"), "{ended}");
    let mut told = Vec::new();
    while let Ok(Some(piece)) = events.chunk().await {
        told.extend_from_slice(&piece);
    }
    let told = String::from_utf8(told).unwrap();
    assert!(told.contains("map a was renamed"), "{told}");
    // A copy goes on as soon as the map has its name again.
    wait_until(async || replica.status().last_error.is_some()).await;
    client.rename_map(&map("b"), &map("a")).await.unwrap();
    daemon.put_in("a", &row(2)).await;
    wait_until(async || replica.status().version.revision == 1).await;
    assert_eq!(replica.status().map_uuid, info.version.map_uuid);
}

#[tokio::test]
async fn an_old_uuid_finds_the_map_under_its_new_name_alone() {
    let daemon = Daemon::start().await;
    let client = client_of(&daemon).await;
    let (info, _) = client.create_map(&map("a"), NewMap::of(0.1)).await.unwrap();
    client.rename_map(&map("a"), &map("b")).await.unwrap();
    let map_uuid = info.version.map_uuid.to_string();
    let of = |name: &str| pb::QueryPointsRequest { map_uuid: map_uuid.clone(), ..query_pb(name, &row(1)) };
    daemon.occupancy().await.query_points(of("b")).await.unwrap();
    client.create_map(&map("a"), NewMap::of(0.1)).await.unwrap();
    let other = daemon.occupancy().await.query_points(of("a")).await.unwrap_err();
    let word = other.metadata().get("mrol-reason").unwrap().to_str().unwrap();
    assert_eq!(word, Reason::MapReplaced.as_str());
}
