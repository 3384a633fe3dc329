//! A robot with no guess asks a running server where it is, over gRPC and over HTTP.

use std::time::Duration;

use mrol::align::Verdict;
use mrol::align::localize::{Gravity, LocalizationQuery, MAP_DOWN, SearchBox};
use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose, pose, pose_difference, translation_m};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{LocalizationRequest, ScanRequest};
use mrol::wire::pb;
use mrol_simulate::{Scene, Tour, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, PATIENCE, bytes_of, json_of, points_pb};

/// A server with a map of the simulated building, and a scan that is not in it.
struct Building {
    daemon: Daemon,
    client: Client,
    map: MapName,
    points: Vec<Point>,
    truth: Pose,
}

impl Building {
    async fn mapped() -> Self {
        let daemon = Daemon::start_with(|config| {
            config.limits.localization_candidates_max = 7;
            config.limits.localization_time_max_s = 50.0;
        });
        let daemon = daemon.await;
        let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
        let map = MapName::new("building").unwrap();
        client.create_map(&map, NewMap { levels: Some(5), ..NewMap::of(0.1) }).await.unwrap();
        let (scene, [tour, _]) = (Scene::furnished(7), tours(50));
        for k in (0..50).step_by(10) {
            let request = ScanRequest {
                guess: Guess::Pose(tour.poses[k]),
                at_guess: true,
                ..ScanRequest::new(RobotName::new("r").unwrap(), scan(&tour, &scene, k).into())
            };
            assert!(client.insert_scan(&map, request).await.unwrap().accepted);
        }
        let (points, truth) = (scan(&tour, &scene, 35), tour.poses[35]);
        Self { daemon, client, map, points, truth }
    }

    /// Which way is down in the sensor frame.
    fn down(&self) -> [f64; 3] {
        self.truth.inverse_transform_vector(&MAP_DOWN.into()).into()
    }

    fn request(&self) -> LocalizationRequest {
        let gravity = Gravity::new(self.down(), MAP_DOWN).ok();
        let query = LocalizationQuery { gravity, candidates: 2, ..LocalizationQuery::default() };
        LocalizationRequest { points: self.points.clone().into(), query, time_limit: None }
    }

    /// A scan that fits along every wall, which takes long to find out.
    fn wall(&self) -> LocalizationRequest {
        let wall = (0..6400)
            .map(|i| Point::new(2.0, (i % 80) as f32 * 0.025 - 1.0, (i / 80) as f32 * 0.02 - 0.8))
            .collect::<Vec<_>>();
        let time_limit = Some(Duration::from_secs(50));
        LocalizationRequest { points: wall.into(), time_limit, query: LocalizationQuery::default() }
    }

    async fn post(&self, body: Value) -> (StatusCode, Value) {
        let answer = self.daemon.post("/v1/maps/building/localize", body).await;
        (answer.status(), json_of(answer).await)
    }
}

fn scan(tour: &Tour, scene: &Scene, k: usize) -> Vec<Point> {
    let mut rng = ChaCha8Rng::seed_from_u64(k as u64);
    tour.sensor.scan(scene, &tour.poses[k], &mut rng)
}

fn pose_of(value: &Value) -> Pose {
    let numbers = |field: &str| -> Vec<f64> { serde_json::from_value(value[field].clone()).unwrap() };
    pose(numbers("translation_m").try_into().unwrap(), numbers("rotation_xyzw").try_into().unwrap()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_is_found_alike_on_every_way_in() {
    let building = Building::mapped().await;
    let found = building.client.localize(&building.map, building.request()).await.unwrap();
    assert_eq!(found.verdict, Verdict::Accepted, "{}", found.reason);
    assert!(found.exhaustive && !found.cut_short && found.accepted());
    let best = &found.candidates[0];
    let (meters, degrees) = pose_difference(&best.map_from_sensor, &building.truth);
    assert!(meters < 0.05 && degrees < 0.5, "{meters} m, {degrees} degrees");
    let rays = best.rays.expect("rays were asked");
    assert!(
        best.overlap > 0.5 && best.inliers > 0.5 && rays.worse() > 0.9 && rays.evidence() > 0.05,
        "{rays:?}"
    );
    assert!(found.rivals.is_empty(), "{:?}", found.rivals);
    assert_eq!(found.version.revision, 5);
    assert_eq!(found.points_skipped, building.points.iter().filter(|point| !point.is_finite()).count());

    let points: Vec<[f32; 3]> = building.points.iter().map(|point| point.xyz()).collect();
    let null = |c: f32| if c.is_finite() { json!(c) } else { Value::Null };
    let as_json: Vec<[Value; 3]> = points.iter().map(|point| point.map(null)).collect();
    let body = json!({"points": as_json, "gravity": {"in_sensor": building.down()}, "candidates": 2});
    let (status, by_json) = building.post(body).await;
    assert_eq!(status, StatusCode::OK, "{by_json}");

    let [x, y, z] = building.down();
    let route = format!("/v1/maps/building/localize?gravity={x},{y},{z}&map_gravity=0,0,-1&candidates=2");
    let by_bytes = json_of(building.daemon.post_bytes(&route, bytes_of(&points)).await).await;
    for answer in [by_json, by_bytes] {
        assert_eq!(answer["accepted"], true, "{answer}");
        assert_eq!(answer["verdict"], "accepted");
        assert_eq!(answer["exhaustive"], true);
        assert_eq!(answer["revision"], 5);
        assert_eq!(answer["points_skipped"], found.points_skipped);
        assert!(answer["search_ms"].as_f64().unwrap() > 0.0);
        let candidates = answer["candidates"].as_array().unwrap();
        assert_eq!(candidates.len(), found.candidates.len());
        for (candidate, expected) in candidates.iter().zip(&found.candidates) {
            let (meters, degrees) =
                pose_difference(&pose_of(&candidate["map_from_sensor"]), &expected.map_from_sensor);
            assert!(meters < 1e-9 && degrees < 1e-5, "{meters} m, {degrees} degrees");
            assert_eq!(candidate["overlap"].as_f64().unwrap(), expected.overlap);
            let rays = expected.rays.unwrap();
            assert_eq!(candidate["rays"]["agreement"].as_f64(), Some(rays.worse()));
            assert_eq!(candidate["rays"]["of_scan"]["agree"].as_u64(), Some(rays.of_scan.agree as u64));
            assert_eq!(candidate["rays"]["of_map"]["asked"].as_u64(), Some(rays.of_map.asked as u64));
        }
        assert_eq!(answer["rivals"], json!([]));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn time_runs_out_and_callers_go_away() {
    let building = Building::mapped().await;
    let at_once = LocalizationRequest { time_limit: Some(Duration::ZERO), ..building.request() };
    let answer = building.client.localize(&building.map, at_once).await.unwrap();
    assert!(answer.cut_short && !answer.exhaustive && !answer.accepted());

    // There is one thread for searches: the second is answered once the first has noticed that nobody waits for it.
    let impatient = building.client.clone().with_timeout(Duration::from_millis(300));
    let error = impatient.localize(&building.map, building.wall()).await.unwrap_err();
    assert!(error.to_string().contains("deadline"), "{error}");
    let unhurried = LocalizationRequest { time_limit: Some(Duration::from_secs(50)), ..building.request() };
    let patient = tokio::time::timeout(4 * PATIENCE, building.client.localize(&building.map, unhurried));
    assert!(patient.await.expect("a thread that is free again").unwrap().accepted());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_question_that_makes_no_sense_is_refused_with_its_reason() {
    let building = Building::mapped().await;
    let mut robot = building.daemon.mapping().await;
    let good = pb::LocalizeRequest {
        map: "building".into(),
        points: points_pb(&[[1.0, 2.0, 3.0]]),
        ..Default::default()
    };
    let vector = |x: f64, y: f64, z: f64| Some(pb::Vector3 { x, y, z });
    let gravity = |in_sensor, in_map| Some(pb::Gravity { in_sensor, in_map });
    let search_box = |min_m, max_m| Some(pb::Box { min_m, max_m });
    for (bad, words) in [
        (pb::LocalizeRequest { points: None, ..good.clone() }, vec!["points", "missing"]),
        (
            pb::LocalizeRequest { points: points_pb(&[[f32::NAN; 3]; 2]), ..good.clone() },
            vec!["none", "2 points"],
        ),
        (
            pb::LocalizeRequest { gravity: gravity(None, None), ..good.clone() },
            vec!["gravity.in_sensor", "missing"],
        ),
        (
            pb::LocalizeRequest { gravity: gravity(vector(0.0, 0.0, 0.0), None), ..good.clone() },
            vec!["gravity.in_sensor", "[0.0, 0.0, 0.0]"],
        ),
        (
            pb::LocalizeRequest {
                gravity: gravity(vector(0.0, 0.0, 1.0), vector(f64::NAN, 0.0, 0.0)),
                ..good.clone()
            },
            vec!["gravity.in_map", "NaN"],
        ),
        (
            pb::LocalizeRequest { search_box: search_box(vector(0.0, 0.0, 0.0), None), ..good.clone() },
            vec!["search_box.max_m", "missing"],
        ),
        (
            pb::LocalizeRequest {
                search_box: search_box(vector(1.0, 0.0, 0.0), vector(0.0, 1.0, 1.0)),
                ..good.clone()
            },
            vec!["search_box.min_m", "must not exceed"],
        ),
        (
            pb::LocalizeRequest {
                search_box: search_box(vector(1e4, 0.0, 0.0), vector(1e4, 1.0, 1.0)),
                ..good.clone()
            },
            vec!["search_box", "nowhere near the map"],
        ),
        (pb::LocalizeRequest { time_limit_s: Some(-1.0), ..good.clone() }, vec!["time_limit_s", "-1"]),
        (pb::LocalizeRequest { time_limit_s: Some(f64::NAN), ..good.clone() }, vec!["time_limit_s", "NaN"]),
        (
            pb::LocalizeRequest { time_limit_s: Some(51.0), ..good.clone() },
            vec!["51s", "localization_time_max is 50s"],
        ),
        (
            pb::LocalizeRequest { candidates: 8, ..good.clone() },
            vec!["8", "localization_candidates_max is 7"],
        ),
    ] {
        let status = robot.localize(bad).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument, "{status}");
        assert!(words.iter().all(|word| status.message().contains(word)), "{words:?}: {}", status.message());
    }
    let points = json!([[1.0, 2.0, 3.0]]);
    for (bad, words) in [
        (json!({"points": points, "gravity": {"in_sensor": [0, 0, 0]}}), ["gravity.in_sensor", "zero"]),
        (
            json!({"points": points, "search_box": {"min_m": [1, 0, 0], "max_m": [0, 0, 0]}}),
            ["search_box", "exceed"],
        ),
        (json!({"points": points, "time_limit_s": -2}), ["time_limit_s", "-2"]),
        (json!({"points": points, "candidates": 8}), ["candidates", "7"]),
        (json!({"points": points, "color": 1}), ["color", "unknown"]),
    ] {
        let (status, error) = building.post(bad).await;
        assert_eq!(status, StatusCode::BAD_REQUEST, "{error}");
        let message = error["detail"].as_str().unwrap();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    }
    let route = "/v1/maps/building/localize?map_gravity=0,0,1";
    let answer = building.daemon.post_bytes(route, bytes_of(&[[1.0; 3]])).await;
    assert_eq!(answer.status(), StatusCode::BAD_REQUEST);

    building.daemon.make_map("empty").await;
    let empty = pb::LocalizeRequest { map: "empty".into(), ..good.clone() };
    let status = robot.localize(empty).await.unwrap_err();
    assert_eq!(status.code(), Code::FailedPrecondition, "{status}");
    let nowhere = pb::LocalizeRequest { map: "nowhere".into(), ..good };
    assert_eq!(robot.localize(nowhere).await.unwrap_err().code(), Code::NotFound);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_request_crosses_the_wire_whole() {
    let building = Building::mapped().await;
    let center = translation_m(&building.truth);
    let around = SearchBox::new(center.map(|c| c - 1.0), center.map(|c| c + 1.0)).ok();
    let query = LocalizationQuery { search_box: around, seed: 3, ..building.request().query };
    let time_limit = Some(Duration::from_millis(2500));
    let request = LocalizationRequest { query, time_limit, ..building.request() };
    let message = pb::LocalizeRequest::from((&building.map, request.clone()));
    let (map, back): (MapName, LocalizationRequest) = message.try_into().unwrap();
    assert_eq!((&map, back.time_limit, back.points), (&building.map, time_limit, request.points.clone()));
    assert_eq!((back.query.search_box, back.query.seed), (query.search_box, 3));
    assert!(building.client.localize(&map, request).await.unwrap().accepted());
}
