//! The scans that touched a voxel, over both protocols.

use mrol::client::Client;
use mrol::map::MapName;
use mrol::service::{ObservedVoxel, ObserversRequest};
use mrol::voxel::VoxelKey;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, json_of, pose_json, row};

async fn insert(daemon: &Daemon, robot: &str, scan_id: u64, from_x: f64) {
    let scan = json!({"robot": robot, "session": "s", "scan_id": scan_id, "timestamp_ns": 7 + scan_id, "points": row(10),
                      "guess": pose_json([from_x, 0.0, 0.0]), "align": false});
    assert_eq!(daemon.post("/v1/maps/a/scans", scan).await.status(), StatusCode::OK);
}

fn revisions(answer: &Value) -> Vec<u64> {
    answer["scans"].as_array().unwrap().iter().map(|scan| scan["revision"].as_u64().unwrap()).collect()
}

#[tokio::test]
async fn they_are_told_newest_first_by_point_or_by_voxel_and_after_a_restart() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (scan_id, from_x) in [(0, 0.0), (1, 0.5), (2, 5.0), (3, 0.2)] {
        insert(&daemon, "r", scan_id, from_x).await;
    }
    let at = "/v1/maps/a/observers?point=0.75,0.05,0.05";
    let told = json_of(daemon.get(at).await).await;
    assert_eq!((revisions(&told), &told["voxel"]), (vec![4, 2, 1], &json!([7, 0, 0])));
    assert_eq!((&told["older_scans"], &told["revision"]), (&json!(false), &json!(4)));
    let newest = json!({"revision": 4, "robot": "r", "session": "s", "scan_id": 3, "timestamp_ns": 10,
                        "map_from_sensor": pose_json([0.2, 0.0, 0.0])});
    assert_eq!(told["scans"][0], newest);

    // A coarser voxel was touched where one within it was.
    let of = async |params: &str| {
        revisions(&json_of(daemon.get(&format!("/v1/maps/a/observers?{params}")).await).await)
    };
    assert_eq!(of("voxel=1,0,0").await, [1]);
    assert_eq!(of("voxel=0,0,0&level=1").await, [1]);
    assert_eq!(of("voxel=0,0,0&level=3").await, [4, 2, 1]);
    assert!(of("voxel=-1,0,0").await.is_empty());

    // What was deleted since was touched all the same; what was undone was not.
    daemon.post("/v1/maps/a/deletions", json!({"points": row(10)})).await;
    daemon.post("/v1/maps/a/undo", json!({"revision": 2})).await;
    let data = daemon.stop().await;
    let daemon = Daemon::start_in(data, |_| {}).await;
    let told = json_of(daemon.get(at).await).await;
    assert_eq!((revisions(&told), &told["older_scans"]), (vec![4, 1], &json!(false)));

    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let name = MapName::new("a").unwrap();
    let by_point = ObservedVoxel::Of([0.75, 0.05, 0.05].into());
    for voxel in [by_point, ObservedVoxel::Key(VoxelKey::new([7, 0, 0]).unwrap())] {
        let answer = client.list_observers(&name, ObserversRequest { voxel, level: 0 }).await.unwrap();
        let scans: Vec<_> = answer.scans.iter().map(|of| (of.revision, of.scan.scan_id)).collect();
        assert_eq!((scans, answer.older_scans), (vec![(4, Some(3)), (1, Some(0))], false));
        assert_eq!((answer.voxel.index(), answer.version.revision), ([7, 0, 0], 6));
        assert_eq!(answer.scans[0].scan.session.as_str(), "s");
    }
}

#[tokio::test]
async fn a_list_ends_at_its_limit_and_says_that_there_is_more() {
    let daemon = Daemon::start_with(|config| config.limits.observers_max = 2).await;
    daemon.make_map("a").await;
    let told = async || json_of(daemon.get("/v1/maps/a/observers?point=0.05,0.05,0.05").await).await;
    for (scan_id, expected, has_older) in [(0, vec![1], false), (1, vec![2, 1], false), (2, vec![3, 2], true)]
    {
        insert(&daemon, "r", scan_id, 0.0).await;
        let told = told().await;
        assert_eq!((revisions(&told), &told["older_scans"]), (expected, &json!(has_older)));
    }
}

#[tokio::test]
async fn what_is_no_voxel_and_what_has_no_journal_is_refused_by_name() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (params, reason, words) in [
        ("", "missing_field", "point or voxel"),
        ("point=0,0,0&voxel=0,0,0", "ambiguous_target", "exactly one of point and voxel"),
        ("point=0,0", "bad_numbers", "point must be 3 numbers"),
        ("point=NaN,0,0", "point_not_finite", "point is not finite"),
        ("point=1e9,0,0", "point_out_of_range", "point is outside the map's range"),
        ("voxel=0.5,0,0", "bad_key", "whole indices"),
        ("voxel=1e9,0,0", "bad_key", "in range"),
        ("voxel=1000000,0,0&level=1", "key_out_of_range", "at level 1"),
        ("point=0,0,0&level=4", "level_out_of_range", "0..=3"),
    ] {
        let answer = daemon.get(&format!("/v1/maps/a/observers?{params}")).await;
        assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{params}");
        let error = json_of(answer).await;
        assert_eq!(error["reason"], reason, "{params}: {error}");
        assert!(error["detail"].as_str().unwrap().contains(words), "{params}: {error}");
    }
    let request = pb::ListObserversRequest { map: "a".into(), ..Default::default() };
    let status = daemon.occupancy().await.list_observers(request).await.unwrap_err();
    assert!(status.message().contains("point_m or key, is missing"), "{status}");

    let daemon = Daemon::start_with(|config| config.data_dir = "".into()).await;
    daemon.make_map("a").await;
    insert(&daemon, "r", 0, 0.0).await;
    let voxel = Some(pb::list_observers_request::Voxel::PointM([0.05, 0.05, 0.05].into()));
    let request = pb::ListObserversRequest { map: "a".into(), voxel, level: 0 };
    let status = daemon.occupancy().await.list_observers(request).await.unwrap_err();
    assert_eq!(status.code(), Code::FailedPrecondition, "{status}");
    assert!(status.message().contains("a list of observers needs the journal"), "{status}");
}

#[tokio::test]
async fn where_there_is_no_time_to_look_there_may_be_older_ones() {
    let daemon = Daemon::start_with(|config| config.limits.observers_time_max_s = 0.0).await;
    daemon.make_map("a").await;
    insert(&daemon, "r", 0, 0.0).await;
    let told = json_of(daemon.get("/v1/maps/a/observers?point=0.05,0.05,0.05").await).await;
    assert_eq!((revisions(&told), &told["older_scans"]), (vec![], &json!(true)));
}
