//! Robots that start again: the sessions of their scan ids.

use mrol::geometry::{Pose, translation_m};
use mrol::map::SESSIONS_PER_ROBOT_MAX;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, identity_json, json_of, points_pb, row, scan_pb};
use crate::support::hall::{hall, seen_from};

const SECOND_NS: i64 = 1_000_000_000;

/// Inserts `points` points as a scan of robot r at its guess; the status and the answer.
async fn insert(daemon: &Daemon, session: &str, scan_id: u64, points: usize) -> (StatusCode, Value) {
    let scan = json!({"robot": "r", "session": session, "scan_id": scan_id, "points": row(points),
        "guess": identity_json(), "align": false});
    let answer = daemon.post("/v1/maps/a/scans", scan).await;
    (answer.status(), json_of(answer).await)
}

/// The reason for which a scan is refused.
async fn refusal(daemon: &Daemon, session: &str, scan_id: u64, points: usize) -> String {
    let (status, answer) = insert(daemon, session, scan_id, points).await;
    assert!(status.is_client_error(), "{status}: {answer}");
    answer["reason"].as_str().unwrap().to_owned()
}

async fn sessions_of(daemon: &Daemon) -> Vec<(String, u64)> {
    let trajectory = json_of(daemon.get("/v1/maps/a/trajectory").await).await;
    let poses = trajectory["poses"].as_array().unwrap().iter();
    poses
        .map(|pose| (pose["session"].as_str().unwrap().to_owned(), pose["scan_id"].as_u64().unwrap()))
        .collect()
}

#[tokio::test]
async fn a_robot_that_starts_again_counts_from_0_in_another_session() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (session, points) in [("", 3), ("boot-1", 4), ("boot-2", 5)] {
        assert_eq!(insert(&daemon, session, 0, points).await.0, StatusCode::OK);
    }
    let expected = ["", "boot-1", "boot-2"].map(|session| (session.to_owned(), 0)).to_vec();
    assert_eq!(sessions_of(&daemon).await, expected);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(sessions_of(&daemon).await, expected);
    for (session, points) in [("", 3), ("boot-1", 4), ("boot-2", 5)] {
        assert_eq!(insert(&daemon, session, 0, points).await.1["replayed"], true);
        assert_eq!(refusal(&daemon, session, 0, points + 1).await, "scan_id_taken");
    }
    for bad in ["boot 1", "é", &"x".repeat(65)] {
        let (status, answer) = insert(&daemon, bad, 1, 3).await;
        assert_eq!(status, StatusCode::BAD_REQUEST);
        assert!(answer["detail"].as_str().unwrap().contains("session must be"), "{answer}");
    }
}

#[tokio::test]
async fn an_undo_of_an_id_of_another_session_names_the_sessions_that_have_it() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (session, points) in [("", 3), ("boot-1", 4), ("boot-2", 5)] {
        assert_eq!(insert(&daemon, session, 7, points).await.0, StatusCode::OK);
    }
    let undo = async |session: &str, id: u64| {
        let undo = json!({"robot": "r", "session": session, "scan_id": id});
        json_of(daemon.post("/v1/maps/a/undo", undo).await).await
    };
    let said = async |session: &str, id: u64| {
        let refused = undo(session, id).await;
        assert_eq!(refused["reason"], "scan_not_found", "{refused}");
        refused["detail"].as_str().unwrap().to_owned()
    };
    let other = said("boot-3", 7).await;
    assert!(other.ends_with("in other sessions: boot-2, boot-1, the empty one"), "{other}");
    assert!(said("boot-3", 8).await.ends_with("scan_id 8 of session boot-3 of robot r"));
    // What was undone cannot be undone, in whichever session.
    assert_eq!(undo("", 7).await["scans"], 1);
    assert_eq!(undo("boot-2", 7).await["scans"], 1);
    let other = said("", 7).await;
    assert!(
        other.ends_with("scan_id 7 of robot r; the robot has one of this id in another session: boot-1"),
        "{other}"
    );
}

#[tokio::test]
async fn the_id_of_an_undone_scan_stays_known() {
    let daemon = Daemon::start_with(|config| config.store.undo_revisions = 3).await;
    daemon.make_map("a").await;
    for (session, points) in [("", 3), ("boot-1", 4)] {
        assert_eq!(insert(&daemon, session, 7, points).await.0, StatusCode::OK);
    }
    let undo = json!({"robot": "r", "session": "boot-1", "scan_id": 7});
    assert_eq!(json_of(daemon.post("/v1/maps/a/undo", undo.clone()).await).await["removed"], 1);
    let before = daemon.contents("a").await;
    let check = async |daemon: &Daemon| {
        assert_eq!(refusal(daemon, "boot-1", 7, 4).await, "scan_withdrawn");
        assert_eq!(refusal(daemon, "boot-1", 7, 5).await, "scan_id_taken");
        let missing = json_of(daemon.post("/v1/maps/a/undo", undo.clone()).await).await;
        assert_eq!(missing["reason"], "scan_not_found");
        assert_eq!(insert(daemon, "", 7, 3).await.1["replayed"], true);
        assert_eq!(daemon.contents("a").await, before);
    };
    check(&daemon).await;
    // From the journal alone, then from a snapshot, then from the map's file.
    let daemon = Daemon::start_in(daemon.stop().await, |config| config.store.undo_revisions = 3).await;
    check(&daemon).await;
    let daemon = Daemon::start_in(daemon.stop().await, |config| config.store.undo_revisions = 3).await;
    check(&daemon).await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap().to_vec();
    let restored = Daemon::start().await;
    crate::support::daemon::client()
        .put(restored.url("/v1/maps/a/snapshot"))
        .header("content-type", "application/octet-stream")
        .body(file)
        .send()
        .await
        .unwrap()
        .error_for_status()
        .unwrap();
    check(&restored).await;
    // Once undo does not reach it any more, its id is all that is known.
    for scan_id in 0..8 {
        assert_eq!(insert(&daemon, "boot-2", scan_id, 10 + scan_id as usize).await.0, StatusCode::OK);
    }
    let daemon = Daemon::start_in(daemon.stop().await, |config| config.store.undo_revisions = 3).await;
    let daemon = Daemon::start_in(daemon.stop().await, |config| config.store.undo_revisions = 3).await;
    assert_eq!(refusal(&daemon, "boot-1", 7, 4).await, "scan_id_too_old");
}

#[tokio::test]
async fn a_session_that_was_closed_is_not_taken_up_again() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for n in 0..=SESSIONS_PER_ROBOT_MAX {
        assert_eq!(insert(&daemon, &format!("boot-{n}"), 0, 3 + n).await.0, StatusCode::OK);
    }
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(refusal(&daemon, "boot-0", 0, 3).await, "scan_id_too_old");
    assert_eq!(refusal(&daemon, "boot-0", 1, 3).await, "scan_id_too_old");
    assert_eq!(insert(&daemon, "boot-1", 0, 4).await.1["replayed"], true);
    assert_eq!(insert(&daemon, "", 0, 4).await.0, StatusCode::OK);
    let undo = json!({"robot": "r", "session": "boot-0", "scan_id": 0});
    let refused = json_of(daemon.post("/v1/maps/a/undo", undo).await).await;
    assert_eq!(refused["reason"], "scan_id_too_old");
    assert!(refused["detail"].as_str().unwrap().contains("session boot-0"), "{refused}");
}

/// A robot of the hall, which sends its scans over one connection after another.
struct Robot {
    daemon: Daemon,
    session: String,
    x: f64,
    time_ns: i64,
    scan_id: u64,
}

impl Robot {
    fn scan(&self) -> pb::InsertScanRequest {
        let points = seen_from(&hall(), &Pose::translation(self.x, 5.0, 1.0));
        let points: Vec<[f32; 3]> = points.iter().map(|point| point.xyz()).collect();
        let scan = pb::Scan {
            robot: "r".into(),
            session: self.session.clone(),
            scan_id: Some(self.scan_id),
            timestamp_ns: Some(self.time_ns),
            points: points_pb(&points),
            ..Default::default()
        };
        let velocity =
            pb::Guess { kind: Some(pb::guess::Kind::ConstantVelocity(true)), ..Default::default() };
        pb::InsertScanRequest {
            guess: Some(velocity),
            at_guess: false,
            scan: Some(scan),
            ..scan_pb("a", "r", &[])
        }
    }

    /// Sends the next scan after `time_ns`, having driven `meters`; it has to be found where it was taken.
    async fn step(&mut self, meters: f64, time_ns: i64) -> pb::InsertScanResponse {
        self.x += meters;
        self.time_ns += time_ns;
        let request = self.scan();
        self.scan_id += 1;
        let answer = self.daemon.mapping().await.insert_scan(request).await.unwrap().into_inner();
        self.check(&answer);
        answer
    }

    fn check(&self, answer: &pb::InsertScanResponse) {
        let alignment = answer.alignment.as_ref().unwrap();
        assert!(answer.accepted, "at {} m: {}", self.x, alignment.reason);
        let pose: Pose = alignment.map_from_sensor.unwrap().try_into().unwrap();
        let [x, y, _] = translation_m(&pose);
        assert!((x - self.x).abs() < 0.05 && (y - 5.0).abs() < 0.05, "{x} {y} instead of {}", self.x);
    }

    /// Begins again as a program does that knows nothing of its former run, and sends the last scan of that again.
    async fn restart(&mut self, session: &str) {
        self.scan_id -= 1;
        let before = self.daemon.contents("a").await;
        let replayed = self.daemon.mapping().await.insert_scan(self.scan()).await.unwrap().into_inner();
        self.check(&replayed);
        (self.session, self.scan_id) = (session.to_owned(), 0);
        let anew = self.daemon.mapping().await.insert_scan(self.scan()).await.unwrap().into_inner();
        self.check(&anew);
        assert!(anew.stationary && !anew.replayed);
        self.scan_id = 1;
        assert_eq!(self.daemon.contents("a").await, before);
    }
}

#[tokio::test]
async fn a_robot_stands_for_ten_minutes_starts_again_twice_and_goes_on() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = Robot { daemon, session: "boot-1".into(), x: 4.0, time_ns: 0, scan_id: 0 };
    let first =
        pb::InsertScanRequest { guess: crate::support::daemon::guess_pb([4.0, 5.0, 1.0]), ..robot.scan() };
    robot.daemon.mapping().await.insert_scan(first).await.unwrap();
    robot.scan_id = 1;
    for _ in 0..5 {
        assert!(!robot.step(0.4, SECOND_NS / 5).await.stationary);
    }
    let mut kept = 0;
    for minute in 0..10 {
        for step in 0..6 {
            let is_stationary = robot.step(0.0, 10 * SECOND_NS).await.stationary;
            // The first scan from where it stands may see what none saw on the way: that is kept.
            assert!(is_stationary || (minute, step) == (0, 0), "step {step} in minute {minute}");
            kept += usize::from(!is_stationary);
        }
        match minute {
            3 => robot.restart("boot-2").await,
            7 => robot.restart("boot-3").await,
            _ => {}
        }
    }
    let info = json_of(robot.daemon.get("/v1/maps/a").await).await;
    let seen = &info["sightings"][0];
    assert_eq!(
        (&seen["robot"], &seen["verdict"], &seen["stationary"]),
        (&json!("r"), &json!("accepted"), &json!(true))
    );
    assert!((seen["map_from_sensor"]["translation_m"][0].as_f64().unwrap() - 6.0).abs() < 0.05, "{seen}");
    for _ in 0..5 {
        assert!(!robot.step(0.4, SECOND_NS / 5).await.stationary);
    }
    let sessions = sessions_of(&robot.daemon).await;
    assert_eq!(sessions.len(), 11 + kept);
    assert_eq!(sessions.last().unwrap().0, "boot-3");
}
