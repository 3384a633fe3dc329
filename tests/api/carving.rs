//! Carving: scans take out of a map what they saw through, and what that leaves is told, undone and kept like all else.

use mrol::client::Client;
use mrol::config::Config;
use mrol::map::MapName;
use mrol::service::{Cause, WatchEvent, WatchRequest};
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::box_in_room::{BOX_M, room};
use crate::support::daemon::{Daemon, PATIENCE, bytes_of, identity_json, json_of, row};

async fn insert(daemon: &Daemon, id: u64, has_box: bool, more: &str) -> Value {
    let guess = if more.contains("align=true") { "" } else { "&guess=0,0,0,0,0,0,1&align=false" };
    // The room looks the same turned around, for which a robot has no time.
    let time_ns = 1_000_000_000_000 + id * 100_000_000;
    let route = format!("/v1/maps/a/scans?robot=r&scan_id={id}&timestamp_ns={time_ns}{guess}{more}");
    let answer = daemon.post_bytes(&route, bytes_of(&room(has_box))).await;
    assert_eq!(answer.status(), StatusCode::OK, "{more}");
    json_of(answer).await
}

fn is_of_box(index: &[i64; 3]) -> bool {
    (0..3).all(|axis| {
        let center_m = (index[axis] as f32 + 0.5) * 0.1;
        (BOX_M[0][axis] - 0.1..=BOX_M[1][axis] + 0.1).contains(&center_m)
    })
}

async fn box_voxels(daemon: &Daemon) -> usize {
    daemon.contents("a").await.1.iter().filter(|index| is_of_box(index)).count()
}

fn carves(config: &mut Config) {
    config.robots.entry("*".into()).or_default().carve = true;
}

#[tokio::test]
async fn a_box_that_was_taken_away_goes_where_the_request_or_the_settings_say_so() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    assert_eq!(insert(&daemon, 1, true, "").await["carved_voxels"], 0);
    let before = box_voxels(&daemon).await;
    assert!(before > 50, "{before} voxels");
    assert_eq!(insert(&daemon, 2, false, "").await["carved_voxels"], 0);
    assert_eq!(box_voxels(&daemon).await, before);
    let carved = insert(&daemon, 3, false, "&carve=true").await["carved_voxels"].as_u64().unwrap();
    assert!(carved as usize * 100 >= before * 95, "{carved} of {before}");
    assert_eq!(box_voxels(&daemon).await, before - carved as usize);
    // The same scan again is answered as before.
    let again = insert(&daemon, 3, false, "&carve=true").await;
    assert_eq!((&again["replayed"], &again["carved_voxels"]), (&json!(true), &json!(carved)));

    let daemon = Daemon::start_with(carves).await;
    daemon.make_map("a").await;
    insert(&daemon, 1, true, "").await;
    assert_eq!(insert(&daemon, 2, false, "&carve=false").await["carved_voxels"], 0);
    assert_eq!(insert(&daemon, 3, false, "").await["carved_voxels"], carved);
}

#[tokio::test]
async fn points_outside_the_maps_range_see_through_nothing() {
    // As drivers write a direction in which nothing returned.
    for nowhere_m in [1e6, 1e20, f32::MAX] {
        let daemon = Daemon::start_with(carves).await;
        daemon.make_map("a").await;
        insert(&daemon, 1, true, "").await;
        let before = box_voxels(&daemon).await;
        let at_box = room(true).into_iter().zip(room(false)).map(|(met, beyond)| (met != beyond, beyond));
        let points: Vec<_> = at_box
            .map(|(is_of_box, point)| match is_of_box {
                true => point.map(|c| if c.abs() > 1.0 { c.signum() * nowhere_m } else { c }),
                false => point,
            })
            .collect();
        let route = "/v1/maps/a/scans?robot=r&scan_id=2&guess=0,0,0,0,0,0,1&align=false";
        let answer = json_of(daemon.post_bytes(route, bytes_of(&points)).await).await;
        assert!(answer["points_skipped"].as_u64().unwrap() > 400, "{answer}");
        assert_eq!(box_voxels(&daemon).await, before, "{nowhere_m}");
        let asked = json!({"points": [[1.5, 0.0, 0.0], [1.5, 0.2, 0.1], [2.5, 0.0, 0.0], [0.8, 0.0, 0.0]]});
        let told = json_of(daemon.post("/v1/maps/a/classification", asked).await).await;
        assert_eq!(
            told["free"],
            json!([false, false, false, true]),
            "only what lies before the box, {nowhere_m}: {told}"
        );
    }
}

#[tokio::test]
async fn what_was_carved_is_told_undone_with_its_scan_and_the_same_after_a_restart() {
    let daemon = Daemon::start_with(carves).await;
    daemon.make_map("a").await;
    insert(&daemon, 1, true, "").await;
    let before = daemon.contents("a").await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let mut messages = client.watch(&MapName::new("a").unwrap(), WatchRequest::default()).await.unwrap();
    let carved = insert(&daemon, 2, false, "").await["carved_voxels"].as_u64().unwrap() as usize;
    let after = daemon.contents("a").await;
    let told = loop {
        let message = tokio::time::timeout(PATIENCE, messages.next()).await.unwrap().unwrap().unwrap();
        if let WatchEvent::Change(part) = message.event {
            break part;
        }
    };
    let Cause::Scan(scan) = told.cause else { panic!("{:?}", told.cause) };
    let removed: Vec<[i64; 3]> =
        told.removed.to_set().unwrap().iter().map(|voxel| voxel.index().map(i64::from)).collect();
    assert!(scan.carved_voxels == carved && carved > 50 && removed.len() == carved);
    assert!(removed.iter().all(|index| before.1.contains(index) && !after.1.contains(index)));
    drop(messages);

    let daemon = Daemon::start_in(daemon.stop().await, carves).await;
    assert_eq!(daemon.contents("a").await, after);
    let trajectory = json_of(daemon.get("/v1/maps/a/trajectory").await).await;
    assert_eq!(trajectory["poses"][1]["carved_voxels"], carved);
    let undone = daemon.post("/v1/maps/a/undo", json!({"robot": "r", "scan_id": 2})).await;
    assert_eq!(undone.status(), StatusCode::OK);
    assert_eq!(daemon.contents("a").await.1, before.1);
}

#[tokio::test]
async fn a_robot_that_stands_still_is_kept_only_where_it_carves() {
    let daemon = Daemon::start_with(carves).await;
    daemon.make_map("a").await;
    insert(&daemon, 1, true, "").await;
    // Until it sees nothing new: without the box, and with it again.
    let mut ids = 2..60;
    for has_box in [false, true] {
        loop {
            let id = ids.next().expect("it sees nothing new in the end");
            let answer = insert(&daemon, id, has_box, "&align=true").await;
            assert_eq!(answer["accepted"], true, "{answer}");
            if answer["stationary"] == true {
                break;
            }
        }
    }
    let id = ids.next().expect("it sees nothing new in the end");
    let answer = insert(&daemon, id, false, "&align=true").await;
    assert_eq!(answer["stationary"], false, "{answer}");
    assert!(answer["new_voxels"].as_u64().unwrap() < 5, "{answer}");
    assert!(answer["carved_voxels"].as_u64().unwrap() > 50, "{answer}");
}

#[tokio::test]
async fn an_alignment_carves_nothing_and_says_so() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(30)).await;
    let body = json!({"robot": "r", "points": row(30), "guess": identity_json(), "carve": true});
    let answer = daemon.post("/v1/maps/a/alignment", body).await;
    assert_eq!(answer.status(), StatusCode::BAD_REQUEST);
    let error = json_of(answer).await;
    assert_eq!(error["reason"], "unexpected_field");
    assert!(error.to_string().contains("carve is for an insertion"), "{error}");
}

#[tokio::test]
async fn a_map_without_moments_is_carved_as_well() {
    let daemon = Daemon::start_with(carves).await;
    let settings = json!({"resolution_m": 0.1, "levels": 4, "filter": "none", "moments": false});
    daemon.put("/v1/maps/a", settings).await;
    insert(&daemon, 1, true, "").await;
    let (before, voxels) = (daemon.contents("a").await.1, box_voxels(&daemon).await);
    let carved = insert(&daemon, 2, false, "").await["carved_voxels"].as_u64().unwrap() as usize;
    assert!(carved * 100 >= voxels * 95, "{carved} of {voxels}");
    daemon.post("/v1/maps/a/undo", json!({"robot": "r", "scan_id": 2})).await;
    assert_eq!(daemon.contents("a").await.1, before);
}
