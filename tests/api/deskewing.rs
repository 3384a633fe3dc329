//! Scans of sensors that move: the times of points.

use mrol::geometry::{Point, Pose, Twist, translation_m};
use mrol::wire::pb;
use nalgebra::Vector3;
use reqwest::StatusCode;
use serde_json::json;

use crate::support::daemon::{Daemon, client, guess_pb, identity_json, json_of, points_pb, row, scan_pb};
use crate::support::hall::{hall, seen_from};

const STEP_NS: i64 = 100_000_000;
const STEP_S: f64 = 0.1;

/// The hall as a sensor at `map_from_sensor` (at time 0) sees it that moves with `velocity`: points at times from -0.1
/// s to 0.
fn swept(map_from_sensor: &Pose, velocity: &Twist) -> (Vec<[f32; 3]>, Vec<f32>) {
    let still = seen_from(&hall(), map_from_sensor);
    let count = still.len() as f32;
    let sweep = still.iter().enumerate().map(|(i, point)| {
        let time_s = (i as f32 / count - 1.0) * 0.1;
        let moved = velocity.motion(f64::from(time_s)).inverse_transform_point(&point.to_f64());
        (Point::from(moved).xyz(), time_s)
    });
    sweep.unzip()
}

fn bytes(times_s: &[f32]) -> Vec<u8> {
    times_s.iter().flat_map(|time_s| time_s.to_le_bytes()).collect()
}

#[tokio::test]
async fn a_scan_of_a_moving_sensor_is_mapped_as_that_of_one_that_stands() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut mapping = daemon.mapping().await;
    let velocity = Twist { linear: Vector3::new(2.0, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 0.3) };
    let mut truth = Pose::translation(6.0, 5.0, 1.0);
    // Standing, as the beginning of every drive.
    for k in 0..2 {
        let points: Vec<[f32; 3]> = seen_from(&hall(), &truth).iter().map(|point| point.xyz()).collect();
        let mut scan = scan_pb("a", "r", &points);
        scan.guess = guess_pb([6.0, 5.0, 1.0]);
        scan.scan.as_mut().unwrap().timestamp_ns = Some(k * STEP_NS);
        scan.force = true;
        mapping.insert_scan(scan).await.unwrap();
    }
    let before = daemon.contents("a").await;
    for k in 2..8 {
        truth *= velocity.motion(STEP_S);
        let (points, times_s) = swept(&truth, &velocity);
        let motion = velocity.motion(STEP_S);
        // Over gRPC from the timestamp, over HTTP from the beginning of the sweep, and without times.
        let mut scan = scan_pb("a", "r", &points);
        let kind = pb::guess::Kind::LastFromSensor((&motion).into());
        scan.guess = Some(pb::Guess { kind: Some(kind), ..Default::default() });
        scan.at_guess = false;
        let inner = scan.scan.as_mut().unwrap();
        inner.timestamp_ns = Some(k * STEP_NS);
        inner.point_times = bytes(&times_s).into();
        let [x, y, z] = translation_m(&motion);
        let [qx, qy, qz, qw]: [f64; 4] = motion.rotation.coords.into();
        let from_start: Vec<f32> = times_s.iter().map(|time_s| time_s - times_s[0]).collect();
        let mut body = bytemuck_bytes(&points);
        let query = format!(
            "/v1/maps/a/alignment?robot=r&timestamp_ns={}&motion={x},{y},{z},{qx},{qy},{qz},{qw}",
            k * STEP_NS
        );
        let raw = json_of(daemon.post_bytes(&query, body.clone()).await).await;
        body.extend(bytes(&from_start));
        let query = format!("{query}&point_times=true&point_times_from_sweep_start=true");
        let over_http = json_of(daemon.post_bytes(&query, body).await).await;
        let answer = mapping.insert_scan(scan).await.unwrap().into_inner();
        let alignment = answer.alignment.unwrap();
        assert!(answer.accepted, "{}", alignment.reason);
        let found: Pose = alignment.map_from_sensor.unwrap().try_into().unwrap();
        let error = (found.translation.vector - truth.translation.vector).norm();
        assert!(error < 0.02, "{error} m off after {k} scans");
        let overlap = |answer: &serde_json::Value| answer["overlap"].as_f64().unwrap();
        assert!((overlap(&over_http) - alignment.overlap).abs() < 0.02, "{over_http}");
        assert!(overlap(&raw) < alignment.overlap - 0.1, "{} against {}", overlap(&raw), alignment.overlap);
    }
    assert_ne!(daemon.contents("a").await, before);
}

fn bytemuck_bytes(points: &[[f32; 3]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect()
}

#[tokio::test]
async fn times_that_are_not_those_of_the_points_are_refused() {
    let daemon = Daemon::start_with(|config| config.limits.point_times_max_s = 0.5).await;
    daemon.make_map("a").await;
    let post = async |times: serde_json::Value, timestamp: serde_json::Value| {
        let scan = json!({"robot": "r", "points": row(3), "guess": identity_json(), "align": false,
            "point_times": times, "timestamp_ns": timestamp});
        let answer = daemon.post("/v1/maps/a/scans", scan).await;
        (answer.status(), json_of(answer).await)
    };
    for (times, timestamp, said) in [
        (json!([0.0, 0.1]), json!(1), "one for each of 3 points, got 2"),
        (json!([0.0, 0.1, 0.6]), json!(1), "point_times[2] must lie within point_times_max_s, 0.5 s"),
        (json!([0.0, 0.1, 0.2]), json!(null), "timestamp_ns"),
    ] {
        let (status, answer) = post(times, timestamp).await;
        assert_eq!((status, &answer["reason"]), (StatusCode::BAD_REQUEST, &json!("bad_point_times")));
        assert!(answer["detail"].as_str().unwrap().contains(said), "{answer}");
    }
    assert_eq!(post(json!([0.0, 0.1, 0.2]), json!(1)).await.0, StatusCode::OK);
    let odd = client()
        .post(daemon.url("/v1/maps/a/scans?robot=r&timestamp_ns=1&point_times=true&align=false"))
        .header("content-type", "application/octet-stream")
        .body(vec![0; 36])
        .send()
        .await
        .unwrap();
    assert_eq!(json_of(odd).await["reason"], "bad_point_times");
    let mut scan = scan_pb("a", "r", &row(3));
    let inner = scan.scan.as_mut().unwrap();
    (inner.timestamp_ns, inner.point_times, inner.points) = (Some(1), vec![0; 13].into(), points_pb(&row(3)));
    let refused = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
    assert!(refused.message().contains("scan.point_times"), "{refused}");
}
