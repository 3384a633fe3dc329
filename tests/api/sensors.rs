//! Sensor models: a robot's, from settings and requests, and those that are not the ones of its points.

use mrol::client::wire::pb;
use mrol::config::Config;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, bytes_of, identity_json, json_of, scan_pb};

/// The sensor of [`room`], and one of twice as many rings and columns.
const MODELS: [&str; 2] = ["spinning 89 180 -88 88", "spinning 177 360 -88 88"];

/// What a sensor in the middle of a room sees all around, a ray every two degrees.
fn room() -> Vec<[f32; 3]> {
    let directions = (0..180).flat_map(|i| (-44..=44).map(move |k| (i as f32 * 2.0 + 0.3, k as f32 * 2.0)));
    directions
        .map(|(azimuth, elevation)| {
            let ((sin, cos), (up, along)) =
                (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
            let direction = [cos * along, sin * along, up];
            let half_m = [3.03f32, 2.53, 1.24];
            let to_wall =
                (0..3).map(|axis| half_m[axis] / direction[axis].abs()).fold(f32::INFINITY, f32::min);
            direction.map(|c| c * to_wall)
        })
        .collect()
}

/// The reason that an answer to the scan `id` gives.
async fn reason(daemon: &Daemon, id: u64, more: &str) -> String {
    let route = format!("/v1/maps/a/scans?robot=r&scan_id={id}&guess=0,0,0,0,0,0,1&align=false{more}");
    let answer = daemon.post_bytes(&route, bytes_of(&room())).await;
    assert_eq!(answer.status(), StatusCode::OK, "{more}");
    json_of(answer).await["reason"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_model_is_used_where_it_is_that_of_the_points_and_the_answer_says_where_it_is_not() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let not_used = format!("sensor model \"{}\" is not used", MODELS[1]);
    for (id, more) in [String::new(), format!("&sensor={}", MODELS[0])].iter().enumerate() {
        let reason = reason(&daemon, id as u64, more).await;
        assert!(!reason.contains("sensor"), "{reason}");
    }
    let wrong = reason(&daemon, 2, &format!("&sensor={}", MODELS[1])).await;
    assert!(wrong.contains(&not_used), "{wrong}");

    let body = json!({"robot": "r", "points": room(), "guess": identity_json(), "sensor": MODELS[1]});
    let judged = json_of(daemon.post("/v1/maps/a/alignment", body).await).await;
    assert!(judged["reason"].as_str().unwrap().contains(&not_used), "{judged}");

    let mut request = scan_pb("a", "r", &room());
    request.scan = request.scan.map(|scan| pb::Scan { sensor: MODELS[1].into(), ..scan });
    let answer = daemon.mapping().await.insert_scan(request).await.unwrap().into_inner();
    assert!(answer.alignment.unwrap().reason.contains(&not_used));
}

#[tokio::test]
async fn a_request_goes_before_the_settings_of_its_robot() {
    let wrong = |config: &mut Config| {
        let robot: Value = json!({"sensor": MODELS[1]});
        config.robots.insert("*".into(), serde_json::from_value(robot).unwrap());
    };
    let daemon = Daemon::start_with(wrong).await;
    daemon.make_map("a").await;
    assert!(reason(&daemon, 1, "").await.contains(MODELS[1]));
    assert!(!reason(&daemon, 2, &format!("&sensor={}", MODELS[0])).await.contains("sensor"));
}

#[tokio::test]
async fn what_is_no_model_is_refused() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let cases = [
        ("spinning 0 1800 -24.9 2", "sensor: rings must lie in 1..=1024, got 0"),
        ("pinhole 640 480 525", "sensor: a sensor model must be \"spinning RINGS COLUMNS"),
    ];
    for (model, message) in cases {
        let body = json!({"robot": "r", "points": [[1, 1, 1]], "guess": identity_json(), "sensor": model});
        let route = format!("/v1/maps/a/scans?robot=r&guess=0,0,0,0,0,0,1&sensor={model}");
        let answers = [
            daemon.post("/v1/maps/a/scans", body).await,
            daemon.post_bytes(&route, bytes_of(&[[1.0, 1.0, 1.0]])).await,
        ];
        for answer in answers {
            assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{model}");
            let error = json_of(answer).await;
            assert_eq!(error["reason"], "bad_sensor", "{error}");
            assert!(error["detail"].as_str().unwrap().contains(message), "{error}");
        }
        let mut request = scan_pb("a", "r", &[[1.0, 1.0, 1.0]]);
        request.scan = request.scan.map(|scan| pb::Scan { sensor: model.into(), ..scan });
        let status = daemon.mapping().await.insert_scan(request).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument);
        assert!(status.message().contains(message), "{status}");
    }
}
