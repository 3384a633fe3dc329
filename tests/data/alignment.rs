//! Real panoramic scans, meters apart, aligned from the pose of the scan before: in process, and through the
//! running daemon over both protocols, to the same poses.

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose, pose, pose_difference};
use mrol::map::{MapName, MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings};
use mrol::service::ScanRequest;
use mrol::util::StopSignal;
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, client, json_of};
use crate::support::shared_scans::{self, ScanSet};

const RESOLUTION_M: f64 = 0.1;
const LEVELS: u32 = 6;

fn in_process(set: &ScanSet) -> Vec<Pose> {
    let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, LEVELS)).unwrap();
    let (robot, sightings) = (robot(), Sightings::default());
    let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
    let pose_of = |k: usize| {
        let points = set.points(k);
        let mapped = mapper.map_scan(&Scan::new(&robot, &points), StopSignal::NEVER).unwrap();
        assert!(mapped.is_inserted(), "scan {k}: {}", mapped.located.alignment.reason);
        mapped.located.alignment.map_from_sensor
    };
    (0..set.files.len()).map(pose_of).collect()
}

fn robot() -> RobotName {
    RobotName::new("r1").unwrap()
}

async fn over_grpc(daemon: &Daemon, set: &ScanSet) -> Vec<Pose> {
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let map = MapName::new("grpc").unwrap();
    client.create_map(&map, NewMap { levels: Some(LEVELS), ..NewMap::of(RESOLUTION_M) }).await.unwrap();
    let mut poses = vec![];
    for k in 0..set.files.len() {
        let request =
            ScanRequest { scan_id: Some(k as u64), ..ScanRequest::new(robot(), set.points(k).into()) };
        let answer = client.insert_scan(&map, request).await.unwrap();
        assert!(answer.accepted);
        poses.push(answer.map_from_sensor);
    }
    poses
}

async fn over_http(daemon: &Daemon, set: &ScanSet) -> Vec<Pose> {
    let made = daemon.put("/v1/maps/http", json!({"resolution_m": RESOLUTION_M, "levels": LEVELS})).await;
    assert_eq!(made.status(), 201);
    let mut poses = vec![];
    for k in 0..set.files.len() {
        let points: Vec<Point> = set.points(k);
        let request = client()
            .post(daemon.url(&format!("/v1/maps/http/scans?robot=r1&scan_id={k}")))
            .header("content-type", "application/octet-stream")
            .body(bytemuck::cast_slice::<Point, u8>(&points).to_vec());
        let answer = json_of(request.send().await.unwrap()).await;
        assert_eq!(answer["accepted"], true, "{answer}");
        poses.push(pose_of(&answer["map_from_sensor"]));
    }
    poses
}

fn pose_of(value: &Value) -> Pose {
    let numbers = |field: &str| -> Vec<f64> { serde_json::from_value(value[field].clone()).unwrap() };
    let translation = numbers("translation_m").try_into().unwrap();
    pose(translation, numbers("rotation_xyzw").try_into().unwrap()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scans_meters_apart_align_to_the_truth_and_alike_on_every_way_in() {
    let Some(set) = shared_scans::open("uos_3dtk_dat") else { return };
    let poses = in_process(&set);
    for (k, (found, truth)) in poses.iter().zip(&set.map_from_sensor).enumerate() {
        let (meters, degrees) = pose_difference(&(set.map_from_sensor[0].inv_mul(truth)), found);
        println!("scan {k}: {meters:.4} m, {degrees:.3} degrees from the truth");
        assert!(meters <= 0.03 && degrees <= 0.4, "scan {k}: {meters} m, {degrees} degrees");
    }
    let daemon = Daemon::start().await;
    let (over_grpc, over_http) = (over_grpc(&daemon, &set).await, over_http(&daemon, &set).await);
    for k in 0..poses.len() {
        // A pose crosses the wire as a quaternion that is normalized again on arrival: the last bit may differ.
        for (way, pose) in [("gRPC", &over_grpc[k]), ("HTTP", &over_http[k])] {
            let (meters, degrees) = pose_difference(&poses[k], pose);
            assert!(meters < 1e-12 && degrees < 1e-6, "scan {k} over {way}: {meters} m, {degrees} degrees");
        }
    }
    daemon.stop().await;
}

/// A wall of the office resembles another one, where rays contradict a twentieth of the scan and nothing of the map.
/// But at the right pose all agrees, so nothing came or went, and the other pose is no rival.
#[test]
fn where_all_agrees_no_pose_is_as_likely_that_needs_a_change() {
    let Some(set) = shared_scans::open("icl_office_kt0") else { return };
    let map = MultiResolutionMap::new(MapSettings::new(0.04, LEVELS)).unwrap();
    let (robot, sightings) = (robot(), Sightings::default());
    let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
    let put = |k: usize| {
        let points = set.points(k);
        let guess = Guess::Pose(set.map_from_sensor[k]);
        let scan = Scan { guess, at_guess: true, ..Scan::new(&robot, &points) };
        mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
    };
    (0..142).for_each(put);
    let points = set.points(142);
    let located = mapper.map_scan(&Scan::new(&robot, &points), StopSignal::NEVER).unwrap().located;
    assert!(located.is_accepted(), "{}", located.alignment.reason);
    let (meters, _) = pose_difference(&set.map_from_sensor[142], &located.alignment.map_from_sensor);
    assert!(meters < 0.02, "{meters} m off");
}
