//! Lost robots over the wire: looked for where they asked for it, without holding up anybody.

use std::time::{Duration, Instant};

use mrol::config::RobotConfig;
use mrol::geometry::{Pose, pose_difference};
use mrol::wire::pb;
use mrol_simulate::{Scene, SpinningLidar, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::support::daemon::{Daemon, json_of, points_pb};

/// A robot that is carried through a building.
struct Carried<'a> {
    daemon: &'a Daemon,
    robot: &'static str,
    scans: u64,
    recover: Option<bool>,
}

/// A pose of a tour through the building.
fn pose(k: usize) -> Pose {
    tours(120)[0].poses[k]
}

impl<'a> Carried<'a> {
    fn new(daemon: &'a Daemon, robot: &'static str) -> Self {
        Self { daemon, robot, scans: 0, recover: None }
    }

    /// Sends a scan taken at `truth`.
    async fn scan(&mut self, truth: &Pose, at_truth: bool) -> pb::InsertScanResponse {
        self.scans += 1;
        let mut random = ChaCha8Rng::seed_from_u64(self.scans);
        let points = SpinningLidar::default().scan(&Scene::furnished(7), truth, &mut random);
        let points: Vec<[f32; 3]> = points.iter().map(|point| point.xyz()).collect();
        let scan = pb::Scan { robot: self.robot.into(), points: points_pb(&points), ..Default::default() };
        let kind = pb::guess::Kind::MapFromSensor(truth.into());
        let request = pb::InsertScanRequest {
            map: "a".into(),
            scan: Some(scan),
            guess: at_truth.then_some(pb::Guess { kind: Some(kind), ..Default::default() }),
            at_guess: at_truth,
            recover: self.recover,
            ..Default::default()
        };
        self.daemon.mapping().await.insert_scan(request).await.unwrap().into_inner()
    }

    /// Carries it into another room after a scan in this one.
    async fn carry(&mut self) {
        assert!(self.scan(&pose(3), true).await.accepted);
        for k in 0..2 {
            let refused = self.scan(&there(k), false).await;
            assert!(!refused.accepted && refused.recovered == 0);
        }
    }
}

/// Where the robot is carried to, farther than guesses are off: it drives on there.
fn there(k: usize) -> Pose {
    pose(98 + k % 10)
}

async fn mapped(recover: bool) -> Daemon {
    let robot = RobotConfig { recover, ..RobotConfig::default() };
    let daemon = Daemon::start_with(|config| {
        config.robots.insert("r".into(), robot);
        config.limits.recovery_search_interval_s = 0.0;
        // A debug build on a busy machine has time too.
        config.limits.recovery_search_time_max_s = 60.0;
    })
    .await;
    let map = json!({"resolution_m": 0.1, "levels": 5});
    assert!(daemon.put("/v1/maps/a", map).await.status().is_success());
    let mut surveyor = Carried::new(&daemon, "surveyor");
    for viewpoint in (0..120).step_by(10).map(pose) {
        assert!(surveyor.scan(&viewpoint, true).await.accepted);
    }
    daemon
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_robot_that_asked_for_it_is_found_again() {
    let daemon = mapped(true).await;
    let mut robot = Carried::new(&daemon, "r");
    robot.carry().await;
    let begun = Instant::now();
    let mut k = 2;
    let (found, truth) = loop {
        let answer = robot.scan(&there(k), false).await;
        if answer.accepted {
            break (answer, there(k));
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "{:?}", answer.alignment);
        k += 1;
        tokio::time::sleep(Duration::from_millis(100)).await;
    };
    assert_eq!(found.recovered(), pb::Recovered::Localization);
    let pose: Pose = found.alignment.unwrap().map_from_sensor.unwrap().try_into().unwrap();
    let (meters, degrees) = pose_difference(&pose, &truth);
    assert!(meters < 0.05 && degrees < 0.5, "{meters} m and {degrees} deg off");
    let series = r#"mrol_robots_recovered_total{map="a",how="localization"}"#;
    assert_eq!(daemon.metric(series).await, Some(1.0));
    let sightings = json_of(daemon.get("/v1/maps/a").await).await["sightings"].clone();
    assert_eq!(
        sightings.as_array().unwrap().iter().find(|seen| seen["robot"] == "r").unwrap()["verdict"],
        "accepted"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_robot_that_did_not_ask_for_it_is_not_looked_for() {
    let daemon = mapped(false).await;
    let searches = r#"mrol_jobs_begun_total{pool="recovery"}"#;
    let before = daemon.metric(searches).await;
    assert_eq!(before, Some(0.0));
    let mut robot = Carried::new(&daemon, "r");
    robot.carry().await;
    for k in 2..5 {
        assert!(!robot.scan(&there(k), false).await.accepted);
    }
    assert_eq!(daemon.metric(searches).await, before);
    // A request may ask for it all the same.
    robot.recover = Some(true);
    robot.scan(&there(5), false).await;
    let begun = Instant::now();
    while daemon.metric(searches).await == before {
        assert!(begun.elapsed() < Duration::from_secs(60));
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn an_alignment_remembers_nothing_and_recovers_nobody() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let scan = json!({"robot": "r", "points": [[1.0, 0.0, 0.0]], "recover": true});
    let refused = json_of(daemon.post("/v1/maps/a/alignment", scan).await).await;
    assert_eq!(refused["reason"], "unexpected_field");
    assert!(refused["detail"].as_str().unwrap().contains("recover"), "{refused}");
}
