//! Scans that leave a map again.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, PATIENCE, client, identity_json, json_of, row};

fn scan_of(robot: &str, scan_id: u64, points: &[[f32; 3]]) -> Value {
    json!({"robot": robot, "scan_id": scan_id, "points": points, "guess": identity_json(), "align": false})
}

/// Undoes scans in map `a` one after another, and counts those that are done.
fn undo_one_after_another(
    daemon: &Daemon,
    robot: &'static str,
    scan_ids: std::ops::Range<u64>,
) -> Arc<AtomicU64> {
    let (url, done) = (daemon.url("/v1/maps/a/undo"), Arc::new(AtomicU64::new(0)));
    let count = Arc::clone(&done);
    tokio::spawn(async move {
        for scan_id in scan_ids {
            let undo = json!({"robot": robot, "scan_id": scan_id});
            let answer = client().post(&url).json(&undo).send().await.unwrap();
            assert_eq!(answer.status(), StatusCode::OK);
            count.fetch_add(1, Ordering::Relaxed);
        }
    });
    done
}

#[tokio::test]
async fn undos_one_after_another_keep_no_other_undo_waiting() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    assert_eq!(daemon.post("/v1/maps/a/scans", scan_of("victim", 1, &row(3))).await.status(), StatusCode::OK);
    for scan_id in 0..60 {
        let scan = scan_of("busy", scan_id, &row(3000));
        assert_eq!(daemon.post("/v1/maps/a/scans", scan).await.status(), StatusCode::OK);
    }
    let done = undo_one_after_another(&daemon, "busy", 0..60);
    while done.load(Ordering::Relaxed) < 3 {
        tokio::task::yield_now().await;
    }
    let before = done.load(Ordering::Relaxed);
    let undone = daemon.post("/v1/maps/a/undo", json!({"robot": "victim", "scan_id": 1})).await;
    let meanwhile = done.load(Ordering::Relaxed) - before;
    assert_eq!(undone.status(), StatusCode::OK);
    assert!(meanwhile <= 3, "{meanwhile} other undos were done first");
}

#[tokio::test]
async fn an_undo_of_all_scans_of_a_robot_leaves_none_from_before_it() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let (url, sent) = (daemon.url("/v1/maps/a/scans"), Arc::new(AtomicU64::new(0)));
    let count = Arc::clone(&sent);
    let robot = tokio::spawn(async move {
        for scan_id in 0.. {
            let scan = scan_of("lost", scan_id, &row(500));
            match client().post(&url).json(&scan).send().await {
                Ok(answer) => assert_eq!(answer.status(), StatusCode::OK),
                Err(_) => return,
            }
            count.fetch_add(1, Ordering::Relaxed);
        }
    });
    let start = Instant::now();
    for wait_for in [150, 200, 250] {
        while sent.load(Ordering::Relaxed) < wait_for {
            assert!(start.elapsed() < 3 * PATIENCE, "scans are no longer answered");
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        let undone = daemon.post("/v1/maps/a/undo", json!({"robot": "lost", "since_revision": 0})).await;
        let undone = json_of(undone).await;
        let left = json_of(daemon.get("/v1/maps/a/trajectory").await).await;
        let made = left["poses"].as_array().unwrap().iter().map(|pose| pose["revision"].as_u64().unwrap());
        let before: Vec<u64> = made.filter(|made| *made < undone["revision"].as_u64().unwrap()).collect();
        assert!(before.is_empty(), "of {undone}, {before:?} are left");
    }
    robot.abort();
}

#[tokio::test]
async fn a_scan_is_undone_and_what_others_saw_stays() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let insert = async |daemon: &Daemon, robot: &str, scan_id: u64, points: &[[f32; 3]]| {
        let scan = json!({"robot": robot, "scan_id": scan_id, "points": points, "guess": identity_json(), "align": false});
        let answer = daemon.post("/v1/maps/a/scans", scan).await;
        assert_eq!(answer.status(), StatusCode::OK);
        json_of(answer).await["revision"].as_u64().unwrap()
    };
    insert(&daemon, "good", 1, &row(4)).await;
    let good = daemon.contents("a").await.1;
    let bad = insert(&daemon, "bad", 1, &row(9)).await;
    insert(&daemon, "bad", 2, &row(12)).await;

    let undo = json!({"robot": "bad", "scan_id": 1, "request_id": "u1"});
    let first = json_of(daemon.post("/v1/maps/a/undo", undo.clone()).await).await;
    // Scan 2 saw all of it too.
    assert_eq!((&first["scans"], &first["removed"]), (&json!(1), &json!(0)));
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let again = json_of(daemon.post("/v1/maps/a/undo", undo).await).await;
    assert_eq!((&again["replayed"], &again["revision"]), (&json!(true), &first["revision"]));
    let missing = daemon.post("/v1/maps/a/undo", json!({"revision": bad})).await;
    assert_eq!(missing.status(), StatusCode::NOT_FOUND);
    assert_eq!(json_of(missing).await["reason"], "scan_not_found");

    let since = pb::RobotSince { robot: "bad".into(), revision: 0 };
    let undo = pb::UndoRequest {
        map: "a".into(),
        target: Some(pb::undo_request::Target::Since(since)),
        ..Default::default()
    };
    let answer = daemon.mapping().await.undo(undo).await.unwrap().into_inner();
    assert_eq!((answer.scans, answer.removed), (1, 8));
    assert_eq!(daemon.contents("a").await.1, good);
    let trajectory = json_of(daemon.get("/v1/maps/a/trajectory").await).await;
    assert_eq!(trajectory["poses"].as_array().unwrap().len(), 1);
    // Its number is not free again.
    for (points, status, reason) in
        [(9, StatusCode::PRECONDITION_FAILED, "scan_withdrawn"), (5, StatusCode::CONFLICT, "scan_id_taken")]
    {
        let refused = daemon.post("/v1/maps/a/scans", scan_of("bad", 1, &row(points))).await;
        assert_eq!(refused.status(), status);
        assert_eq!(json_of(refused).await["reason"], reason);
    }
    for body in [json!({"robot": "bad"}), json!({"revision": 1, "robot": "bad"}), json!({})] {
        assert_eq!(daemon.post("/v1/maps/a/undo", body).await.status(), StatusCode::BAD_REQUEST);
    }
}

#[tokio::test]
async fn what_is_out_of_reach_cannot_be_undone_and_the_error_says_how_far_it_reaches() {
    let daemon = Daemon::start_with(|config| config.store.undo_revisions = 1).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(2)).await;
    // Each start and end writes a snapshot.
    let mut data = daemon.stop().await;
    for _ in 0..3 {
        let daemon = Daemon::start_in(data, |config| config.store.undo_revisions = 1).await;
        daemon.put_in("a", &row(3)).await;
        data = daemon.stop().await;
    }
    let daemon = Daemon::start_in(data, |_| {}).await;
    let refused = daemon.post("/v1/maps/a/undo", json!({"revision": 1})).await;
    assert_eq!(refused.status(), StatusCode::PRECONDITION_FAILED);
    let error = json_of(refused).await;
    assert_eq!(error["reason"], "outside_undo_window");
    let reach = json_of(daemon.get("/v1/maps/a").await).await["storage"]["undo_from_revision"].clone();
    assert!(
        error["detail"].as_str().unwrap().contains(&format!("reaches back to revision {reach}")),
        "{error}"
    );
    assert_eq!(daemon.post("/v1/maps/a/undo", json!({"revision": reach})).await.status(), StatusCode::OK);

    let in_memory = Daemon::start_with(|config| config.data_dir = "".into()).await;
    in_memory.make_map("a").await;
    let refused = in_memory.post("/v1/maps/a/undo", json!({"revision": 1})).await;
    assert_eq!(json_of(refused).await["reason"], "no_journal");
}
