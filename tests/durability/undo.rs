//! Scans that leave a map again.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

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
    for unknown in [json!({"robot": "bda", "since_revision": 0}), json!({"robot": "bda", "scan_id": 1})] {
        let refused = daemon.post("/v1/maps/a/undo", unknown).await;
        assert_eq!(refused.status(), StatusCode::NOT_FOUND);
        let refused = json_of(refused).await;
        let message = refused["detail"].as_str().unwrap();
        assert_eq!(refused["reason"], "robot_not_found");
        assert!(message.contains("knows no robot bda: it has scans of bad, good"), "{message}");
    }
    let since = pb::RobotSince { robot: "bda".into(), revision: 0 };
    let target = Some(pb::undo_request::Target::Since(since));
    let undo = pb::UndoRequest { map: "a".into(), target, ..Default::default() };
    assert_eq!(daemon.mapping().await.undo(undo).await.unwrap_err().code(), Code::NotFound);

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

/// The answer to an undo, and the map's finest voxels after it.
async fn undo(daemon: &Daemon, undo: Value) -> (StatusCode, Value) {
    let answer = daemon.post("/v1/maps/a/undo", undo).await;
    (answer.status(), json_of(answer).await)
}

#[tokio::test]
async fn a_deletion_is_taken_back_once_and_its_undo_not_at_all() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (scan_id, points) in [(1, 5), (2, 9)] {
        let scan = scan_of("r", scan_id, &row(points));
        assert_eq!(daemon.post("/v1/maps/a/scans", scan).await.status(), StatusCode::OK);
    }
    let before = daemon.contents("a").await.1;
    let hash = async || json_of(daemon.get("/v1/maps/a").await).await["content_hash"].clone();
    let first_hash = hash().await;
    let everything = json!({"box": {"min_m": [-9, -9, -9], "max_m": [9, 9, 9]}, "request_id": "all"});
    let deleted = json_of(daemon.post("/v1/maps/a/deletions", everything.clone()).await).await;
    assert_eq!((&deleted["removed"], &deleted["revision"]), (&json!(9), &json!(3)));

    let (status, undone) = undo(&daemon, json!({"revision": 3, "request_id": "back"})).await;
    let counts = ["scans", "deletions", "removed", "restored", "revision"].map(|field| undone[field].clone());
    assert_eq!((status, counts), (StatusCode::OK, [json!(0), json!(1), json!(0), json!(9), json!(4)]));
    assert_eq!((daemon.contents("a").await.1, hash().await), (before, first_hash));
    // The same again is the first answer, and the deletion is answered as before, under its own id.
    let (_, again) = undo(&daemon, json!({"revision": 3, "request_id": "back"})).await;
    assert_eq!((&again["replayed"], &again["restored"]), (&json!(true), &json!(9)));
    let deleted = json_of(daemon.post("/v1/maps/a/deletions", everything).await).await;
    assert_eq!((&deleted["replayed"], &deleted["removed"]), (&json!(true), &json!(9)));

    for (revision, reason, why) in [
        (3, "not_undoable", "revision 3 of map a was undone already, by revision 4"),
        (4, "not_undoable", "revision 4 of map a was made by an undo"),
        (5, "scan_not_found", "revision 5"),
    ] {
        let (_, refused) = undo(&daemon, json!({"revision": revision})).await;
        assert_eq!(refused["reason"], reason, "{refused}");
        assert!(refused["detail"].as_str().unwrap().contains(why), "{refused}");
    }
    // It survives a restart, and so does that it was taken back.
    let before = daemon.contents("a").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("a").await, before);
    assert_eq!(undo(&daemon, json!({"revision": 3})).await.1["reason"], "not_undoable");
    let metrics = daemon.get("/metrics").await.text().await.unwrap();
    assert!(!metrics.contains(r#"mrol_deletions_undone_total{map="a"}"#), "{metrics}");
}

#[tokio::test]
async fn scans_and_deletions_are_undone_in_any_order() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let voxels = async || daemon.contents("a").await.1.len();
    for (scan_id, points) in [(1, 5), (2, 9)] {
        let scan = scan_of("r", scan_id, &row(points));
        assert_eq!(daemon.post("/v1/maps/a/scans", scan).await.status(), StatusCode::OK);
    }
    for points in [row(3), row(7)] {
        let deleted = daemon.post("/v1/maps/a/deletions", json!({"points": points})).await;
        assert_eq!(deleted.status(), StatusCode::OK);
    }
    assert_eq!(voxels().await, 2);
    // The second deletion took only what the first had left.
    assert_eq!(undo(&daemon, json!({"revision": 3})).await.1["restored"], 3);
    assert_eq!(voxels().await, 5);
    // Of the second scan, what nobody deleted and the first scan does not hold goes.
    let (_, undone) = undo(&daemon, json!({"robot": "r", "scan_id": 2})).await;
    assert_eq!((&undone["removed"], voxels().await), (&json!(2), 3));
    // What the second deletion took of the first scan comes back, and nothing of the second scan.
    assert_eq!(undo(&daemon, json!({"revision": 4})).await.1["restored"], 2);
    assert_eq!(voxels().await, 5);
    let (_, undone) = undo(&daemon, json!({"robot": "r", "scan_id": 1})).await;
    assert_eq!((&undone["removed"], voxels().await), (&json!(5), 0));
}
