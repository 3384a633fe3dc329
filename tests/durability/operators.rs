//! What operators put into the data folder, and maps that take the place of others.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::config::Config;
use mrol::geometry::Pose;
use mrol::map::{
    CompletedRequest, MapContents, MapName, MapSettings, MappedScan, RequestId, RequestKind, RobotName,
    Trajectory,
};
use mrol::store::{Durability, Snapshot};
use mrol::visibility::{Viewpoint, ViewpointSet};
use mrol::voxel::{VoxelKey, VoxelSet};
use reqwest::StatusCode;
use serde_json::{Value, json};
use uuid::Uuid;

use super::data_folders::put_file;
use crate::support::daemon::{Daemon, json_of, row};
use crate::support::map_folders::folder_of;
use crate::support::range_images::through_a_window;

#[tokio::test]
async fn a_backup_beside_its_map_stays_and_the_map_is_served() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let data = daemon.stop().await;
    let maps = data.path().join("maps");
    // Of the map itself, from before it went on; a folder that is none; and what no server knows.
    let backup =
        std::fs::read(folder_of(data.path(), "a").join("snapshot-00000000000000000001.mrol")).unwrap();
    std::fs::create_dir(maps.join(format!("bare.{}", Uuid::from_u128(7)))).unwrap();
    std::fs::write(maps.join("notes.txt"), "mine").unwrap();
    let daemon = Daemon::start_in(data, |_| {}).await;
    daemon.put_in("a", &row(7)).await;
    let contents = daemon.contents("a").await;
    let mut data = daemon.stop().await;
    std::fs::write(maps.join("a.mrol"), &backup).unwrap();
    for _ in 0..2 {
        let daemon = Daemon::start_in(data, |_| {}).await;
        assert_eq!(daemon.contents("a").await, contents);
        let ready = json_of(daemon.get("/readyz").await).await;
        let unavailable: Vec<&Value> = ready["unavailable"].as_array().unwrap().iter().collect();
        assert_eq!((unavailable.len(), &unavailable[0]["map"]), (1, &json!("bare")), "{ready}");
        assert_eq!(std::fs::read(maps.join("a.mrol")).unwrap(), backup);
        assert_eq!(std::fs::read(maps.join("notes.txt")).unwrap(), b"mine");
        data = daemon.stop().await;
    }
}

#[tokio::test]
async fn what_was_acknowledged_of_a_replaced_map_is_synced() {
    let hourly = |config: &mut mrol::config::Config| {
        config.store.durability = Durability::Interval(Duration::from_secs(3600));
    };
    let daemon = Daemon::start_with(hourly).await;
    daemon.make_map("a").await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    daemon.put_in("a", &row(7)).await;
    let durable = async |map: &str| {
        let map = json_of(daemon.get(&format!("/v1/maps/{map}")).await).await;
        map["storage"]["durable_revision"].as_u64().unwrap()
    };
    assert_eq!(durable("a").await, 0, "nothing is to be synced yet");
    let replaced = put_file(&daemon, "/v1/maps/a/snapshot?replace=true", file.to_vec()).send().await.unwrap();
    assert_eq!(replaced.status(), StatusCode::CREATED);
    assert_eq!(durable("a-replaced-1").await, 1);
    let daemon = Daemon::start_in(daemon.stop().await, hourly).await;
    assert_eq!(daemon.contents("a-replaced-1").await.1.len(), 7);
}

/// A file of a map of a voxel, with what `change` makes of it.
fn file_with(change: impl FnOnce(&mut MapContents)) -> Vec<u8> {
    let mut contents =
        MapContents::at(9, [VoxelKey::new([1, 2, 3]).unwrap()].into_iter().collect::<VoxelSet>());
    change(&mut contents);
    Snapshot { uuid: Uuid::from_u128(7), settings: MapSettings::new(0.1, 4), contents }.encode().unwrap()
}

fn pose(robot: &str, revision: u64, overlaps: usize) -> MappedScan {
    let pose = MappedScan::new(RobotName::new(robot).unwrap(), Pose::identity());
    MappedScan { revision, scan_id: Some(revision), level_overlaps: vec![0.5; overlaps], ..pose }
}

fn viewpoints(revisions: &[u64]) -> ViewpointSet {
    let mut viewpoints = ViewpointSet::default();
    for &revision in revisions {
        let pose = Pose::translation(revision as f64, 0.0, 0.0);
        viewpoints.insert(revision, Arc::new(Viewpoint::new(pose, through_a_window(revision as f32))));
    }
    viewpoints
}

/// Names of the files in a map's folder that end so.
fn files_of(data: &Path, map: &str, end: &str) -> Vec<String> {
    let names = std::fs::read_dir(folder_of(data, map)).unwrap();
    let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(end)).collect();
    names.sort();
    names
}

/// Makes a revision of map `a` that leaves its viewpoints as they are.
async fn change_something(daemon: &Daemon, name: &str) {
    let shape = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    let put = daemon.put(&format!("/v1/maps/a/keep-outs/{name}"), shape).await;
    assert!(put.status().is_success(), "{put:?}");
}

#[tokio::test]
async fn viewpoints_of_a_restored_map_are_described_copied_kept_and_given_out_again() {
    let daemon = Daemon::start().await;
    let all = viewpoints(&[1, 4, 9]);
    let file = file_with(|contents| contents.viewpoints = Arc::new(all.clone()));
    let put = put_file(&daemon, "/v1/maps/a/snapshot", file).send().await.unwrap();
    assert_eq!(put.status(), StatusCode::CREATED);
    let described = async |daemon: &Daemon| {
        let map = json_of(daemon.get("/v1/maps/a").await).await;
        assert_eq!((&map["viewpoints"], &map["viewpoint_bytes"]), (&json!(3), &json!(all.memory_bytes())));
        let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
        let name = MapName::new("a").unwrap();
        let info = client.map_info(&name).await.unwrap();
        assert_eq!((info.viewpoints, info.viewpoint_bytes), (3, all.memory_bytes()));
        assert_eq!(daemon.metric("mrol_map_viewpoints{map=\"a\"}").await, Some(3.0));
        let replica = Replica::open(client, name, ReplicaOptions::default()).await.unwrap();
        assert!(*replica.map().viewpoints() == all);
        let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
        assert!(*Snapshot::decode(&file).unwrap().contents.viewpoints == all);
    };
    described(&daemon).await;
    change_something(&daemon, "first").await;
    let mut data = daemon.stop().await;
    // The snapshot at the server's end has them in a part, which the next ones name.
    let first = [files_of(data.path(), "a", ".part"), files_of(data.path(), "a", ".copy")];
    assert_eq!(first.each_ref().map(Vec::len), [1, 1]);
    for points in 4..7 {
        let daemon = Daemon::start_in(data, |_| {}).await;
        described(&daemon).await;
        change_something(&daemon, &format!("keep-out-{points}")).await;
        data = daemon.stop().await;
        assert_eq!([files_of(data.path(), "a", ".part"), files_of(data.path(), "a", ".copy")], first);
    }
    // One of the two is damaged: the other is read, and the next snapshot writes both again.
    let part = folder_of(data.path(), "a").join(&first[0][0]);
    let mut bytes = std::fs::read(&part).unwrap();
    bytes[50] ^= 1;
    std::fs::write(&part, bytes).unwrap();
    let daemon = Daemon::start_in(data, |_| {}).await;
    described(&daemon).await;
    change_something(&daemon, "last").await;
    let data = daemon.stop().await;
    assert!(files_of(data.path(), "a", ".part").last() > first[0].last());
    described(&Daemon::start_in(data, |_| {}).await).await;
}

#[tokio::test]
async fn a_map_file_is_held_to_the_limits_of_a_map() {
    let small = |config: &mut Config| {
        (config.limits.robots_per_map_max, config.limits.viewpoint_bytes_max) = (2, 5000);
    };
    let daemon = Daemon::start_with(small).await;
    let restore = async |name: &str, file: Vec<u8>| {
        let put = put_file(&daemon, &format!("/v1/maps/{name}/snapshot"), file).send().await.unwrap();
        (put.status(), put.text().await.unwrap())
    };
    let robots = |names: &[&str]| {
        let poses: Vec<_> = (1..).zip(names).map(|(revision, name)| pose(name, revision, 4)).collect();
        file_with(|contents| contents.trajectory = Trajectory::new(poses, Vec::new()))
    };
    assert_eq!(restore("two", robots(&["r1", "r2"])).await.0, StatusCode::CREATED);
    let (status, said) = restore("three", robots(&["r1", "r2", "r3"])).await;
    assert_eq!(status, StatusCode::TOO_MANY_REQUESTS, "{said}");
    assert!(said.contains("map_full") && said.contains("robots_per_map_max is 2"), "{said}");

    let overlaps =
        file_with(|contents| contents.trajectory = Trajectory::new([pose("r1", 1, 5)], Vec::new()));
    let (status, said) = restore("overlaps", overlaps).await;
    assert_eq!(status, StatusCode::BAD_REQUEST, "{said}");
    assert!(said.contains("5 overlaps, of a map of 4 levels"), "{said}");

    let requests = |of: &[(&str, u64, usize)]| {
        let request = |&(id, revision, scans): &(&str, u64, usize)| CompletedRequest {
            id: RequestId::new(id).unwrap(),
            caller: None,
            digest: 1,
            revision,
            removed: 1,
            restored: 0,
            deletions: 0,
            scans,
            kind: if scans > 0 { RequestKind::Undo } else { RequestKind::Deletion },
        };
        file_with(|contents| contents.requests = of.iter().map(request).collect())
    };
    let of_viewpoints =
        file_with(|contents| contents.viewpoints = Arc::new(viewpoints(&[1, 2, 3, 4, 5, 6, 7])));
    let (status, said) = restore("viewpoints", of_viewpoints).await;
    assert_eq!(status, StatusCode::TOO_MANY_REQUESTS, "{said}");
    assert!(said.contains("map_full") && said.contains("viewpoint_bytes_max is 5000"), "{said}");

    // An undo and a deletion may have one id.
    assert_eq!(restore("kinds", requests(&[("x", 2, 0), ("x", 3, 1)])).await.0, StatusCode::CREATED);
}
