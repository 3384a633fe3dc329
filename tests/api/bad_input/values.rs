//! Values that are out of range, missing, or of the wrong form.

use mrol::wire::pb;
use pb::delete_voxels_request::Target;
use reqwest::StatusCode;
use serde_json::json;
use tonic::Code;

use super::{assert_invalid, assert_refused, assert_says, assert_unchanged, daemon, refused};
use crate::support::daemon::{
    bytes_of, client, guess_pb, identity_json, json_of, points_pb, query_pb, row, scan_pb,
};

#[tokio::test]
async fn points_that_fall_in_no_voxel_are_named_by_their_place() {
    let daemon = daemon().await;
    let mut planner = daemon.occupancy().await;
    let mut robot = daemon.mapping().await;
    // 2^20 voxels of 0.1 m reach to 104,857.6 m.
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 104_858.0, -104_858.0] {
        let points = [row(1)[0], row(2)[1], [0.0, bad, 0.0]];
        let status = planner.query_points(query_pb("a", &points)).await.unwrap_err();
        assert_invalid(&status, &["points[2]"]);
        let deletion = pb::DeleteVoxelsRequest {
            map: "a".into(),
            target: points_pb(&points).map(Target::Points),
            ..Default::default()
        };
        assert_invalid(&robot.delete_voxels(deletion).await.unwrap_err(), &["points[2]"]);
        for route in ["occupancy", "deletions"] {
            let answer = daemon.post_bytes(&format!("/v1/maps/a/{route}"), bytes_of(&points)).await;
            assert_refused(refused(answer).await, &["points[2]"]);
        }
        if bad.is_finite() {
            let answer = daemon.post("/v1/maps/a/occupancy", json!({"points": points})).await;
            assert_refused(refused(answer).await, &["points[2]", "104858"]);
        }
    }
    let null = daemon.post("/v1/maps/a/occupancy", json!({"points": [[0, 0, 0], [0, null, 0]]})).await;
    assert_refused(refused(null).await, &["points[1]"]);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn what_is_no_pose_is_refused_with_its_norm() {
    let daemon = daemon().await;
    let twice = pb::Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 2.0 };
    let pose = pb::Pose { rotation: Some(twice), ..crate::support::daemon::pose_pb([0.0; 3]) };
    let query = pb::QueryPointsRequest { map_from_points: Some(pose), ..query_pb("a", &row(1)) };
    let status = daemon.occupancy().await.query_points(query).await.unwrap_err();
    assert_invalid(&status, &["map_from_points", "rotation", "norm 2", "0.001"]);
    let guess = pb::Guess { kind: Some(pb::guess::Kind::MapFromSensor(pose)), ..Default::default() };
    let scan = pb::InsertScanRequest { guess: Some(guess), ..scan_pb("a", "r", &row(1)) };
    let status = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
    assert_invalid(&status, &["guess.map_from_sensor", "norm 2"]);
    let half = pb::Pose { rotation: None, ..pose };
    let guess = pb::Guess { kind: Some(pb::guess::Kind::LastFromSensor(half)), ..Default::default() };
    let scan = pb::InsertScanRequest { guess: Some(guess), ..scan_pb("a", "r", &row(1)) };
    let status = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
    assert_invalid(&status, &["guess.last_from_sensor", "rotation is missing"]);

    let twice = json!({"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 2]});
    for (route, field, rest) in [
        ("occupancy", "map_from_points", json!({})),
        ("scans", "guess", json!({"robot": "r"})),
        ("scans", "motion", json!({"robot": "r"})),
        ("alignment", "guess", json!({"robot": "r"})),
    ] {
        let mut body = rest;
        body["points"] = json!(row(1));
        body[field] = twice.clone();
        let answer = daemon.post(&format!("/v1/maps/a/{route}"), body).await;
        assert_refused(refused(answer).await, &[field, "rotation", "norm 2", "0.001"]);
    }
    for (route, field) in [("occupancy?", "pose"), ("scans?robot=r&", "guess"), ("scans?robot=r&", "motion")]
    {
        for (value, words) in [
            ("0,0,0,0,0,0,2", ["norm 2", "0.001"]),
            ("nan,0,0,0,0,0,1", ["translation_m", "finite"]),
            ("1,2,3", ["7 numbers", "\"1,2,3\""]),
        ] {
            let route = format!("/v1/maps/a/{route}{field}={value}");
            let answer = daemon.post_bytes(&route, bytes_of(&row(1))).await;
            assert_refused(refused(answer).await, &[field, words[0], words[1]]);
        }
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn batches_are_neither_empty_nor_beyond_the_limit() {
    let daemon = daemon().await;
    let mut planner = daemon.occupancy().await;
    let mut robot = daemon.mapping().await;
    for (count, words) in [(0, ["points", "point"]), (101, ["101", "100"])] {
        let points = row(count);
        let status = planner.query_points(query_pb("a", &points)).await.unwrap_err();
        assert_invalid(&status, &words);
        assert_invalid(&robot.insert_scan(scan_pb("a", "r", &points)).await.unwrap_err(), &words);
        for (route, body) in [
            ("occupancy", json!({"points": points})),
            ("deletions", json!({"points": points})),
            ("scans", json!({"robot": "r", "points": points, "guess": identity_json()})),
            ("alignment", json!({"robot": "r", "points": points, "guess": identity_json()})),
        ] {
            let json = daemon.post(&format!("/v1/maps/a/{route}"), body).await;
            assert_refused(refused(json).await, &words);
            let robot =
                if route == "scans" || route == "alignment" { "?robot=r&guess=0,0,0,0,0,0,1" } else { "" };
            let bytes = daemon.post_bytes(&format!("/v1/maps/a/{route}{robot}"), bytes_of(&points)).await;
            assert_refused(refused(bytes).await, &words);
        }
    }
    let keys = |keys: Vec<u64>| pb::DeleteVoxelsRequest {
        map: "a".into(),
        target: Some(Target::Keys(pb::VoxelKeys { keys })),
        ..Default::default()
    };
    assert_invalid(&robot.delete_voxels(keys(vec![])).await.unwrap_err(), &["keys"]);
    assert_invalid(&robot.delete_voxels(keys(vec![0; 101])).await.unwrap_err(), &["keys", "101", "100"]);
    assert_invalid(&robot.delete_voxels(keys(vec![0, 1 << 63])).await.unwrap_err(), &["keys[1]", "bit 63"]);
    let neither = pb::DeleteVoxelsRequest { target: None, ..keys(vec![]) };
    assert_invalid(&robot.delete_voxels(neither).await.unwrap_err(), &["target is missing"]);
    let without_region = pb::DeleteVoxelsRequest { not_seen_since: Some(0), ..keys(vec![0]) };
    let refusal = robot.delete_voxels(without_region).await.unwrap_err();
    assert_invalid(&refusal, &["not_seen_since is 0", "needs a region"]);
    let not_reached = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}, "not_seen_since": 99});
    let answer = daemon.post("/v1/maps/a/deletions", not_reached).await;
    assert_refused(refused(answer).await, &["not_seen_since", "got 99"]);
    let of_points = json!({"points": row(1), "not_seen_since": 1});
    let answer = daemon.post("/v1/maps/a/deletions", of_points).await;
    assert_refused(refused(answer).await, &["not_seen_since is 1", "needs a region"]);
    for body in [json!({}), json!({"points": row(1), "voxels": [[0, 0, 0]]})] {
        let answer = daemon.post("/v1/maps/a/deletions", body).await;
        assert_refused(
            refused(answer).await,
            &["exactly one of points, voxels, box, sphere and oriented_box"],
        );
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn a_message_beyond_the_limit_is_refused_before_it_is_read() {
    let daemon = daemon().await;
    let large = row(2000);
    let status = daemon.occupancy().await.query_points(query_pb("a", &large)).await.unwrap_err();
    assert_eq!(status.code(), Code::ResourceExhausted);
    assert!(status.message().starts_with("message_bytes_max is 20000"), "{status:?}");
    assert_says(status.message(), &["20000"]);
    let answer = daemon.post_bytes("/v1/maps/a/occupancy", bytes_of(&large)).await;
    assert_eq!(answer.status(), StatusCode::PAYLOAD_TOO_LARGE);
    let error = json_of(answer).await;
    assert_eq!(error["reason"], "body_too_large");
    assert_says(error["detail"].as_str().unwrap_or_default(), &["20000", "24000"]);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn maps_that_are_none_are_named() {
    let daemon = daemon().await;
    let status = daemon.occupancy().await.query_points(query_pb("attic", &row(1))).await.unwrap_err();
    assert_eq!(status.code(), Code::NotFound);
    assert_says(status.message(), &["attic"]);
    for route in ["", "/trajectory", "/voxels"] {
        let answer = daemon.get(&format!("/v1/maps/attic{route}")).await;
        assert_eq!(answer.status(), StatusCode::NOT_FOUND);
        assert_says(json_of(answer).await["detail"].as_str().unwrap_or_default(), &["attic"]);
    }
    // Names that would be paths, or none at all; the last two never reach a route.
    for name in ["..", "../a", "a/../../etc", "A", "a b", "", "ä", "a\0", &"x".repeat(65)] {
        let create = pb::CreateMapRequest {
            map: name.into(),
            settings: Some(pb::MapSettings { resolution_m: 0.1, ..Default::default() }),
        };
        let status = daemon.maps().await.create_map(create).await.unwrap_err();
        assert_invalid(&status, &["map must match [a-z0-9][a-z0-9_-]{0,63}"]);
    }
    for name in ["%2e%2e%2fa", "a%2f..%2f..%2fetc", "A", "a%20b", "%c3%a4", "a%00", "%ff", &"x".repeat(65)] {
        let answer = daemon.put(&format!("/v1/maps/{name}"), json!({"resolution_m": 0.1})).await;
        assert_refused(refused(answer).await, &[]);
    }
    let listed = json_of(daemon.get("/v1/maps").await).await;
    assert_eq!(listed["maps"].as_array().map(Vec::len), Some(1));
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn settings_and_levels_out_of_range_are_named_with_the_range() {
    let daemon = daemon().await;
    for (settings, words) in [
        (json!({"resolution_m": 0.0}), ["resolution_m", "0.001"]),
        (json!({"resolution_m": 1000}), ["resolution_m", "100"]),
        (json!({"resolution_m": 0.1, "levels": 13}), ["levels", "12"]),
        (json!({"resolution_m": 0.1, "levels": 0}), ["levels", "1..=12"]),
        (json!({"resolution_m": 0.1, "filter": {"hashes": 0}}), ["hashes", "1"]),
        (json!({"resolution_m": 0.1, "filter": {"bits_per_key": 0}}), ["bits_per", "0"]),
        (json!({"levels": 4}), ["missing field", "resolution_m"]),
        (json!({"resolution_m": 0.1, "color": 1}), ["unknown field", "color"]),
    ] {
        assert_refused(refused(daemon.put("/v1/maps/b", settings).await).await, &words);
    }
    let missing = pb::CreateMapRequest { map: "b".into(), settings: None };
    let status = daemon.maps().await.create_map(missing).await.unwrap_err();
    assert_invalid(&status, &["settings is missing"]);

    let mut planner = daemon.occupancy().await;
    let query = pb::QueryPointsRequest { level: 4, ..query_pb("a", &row(1)) };
    assert_invalid(&planner.query_points(query).await.unwrap_err(), &["level", "4"]);
    let list = pb::ListVoxelsRequest { map: "a".into(), level: u32::MAX, ..Default::default() };
    assert_invalid(&planner.list_voxels(list).await.unwrap_err(), &["level", "4294967295"]);
    let lookup = pb::QueryPointsRequest { lookup: 9, ..query_pb("a", &row(1)) };
    assert_invalid(&planner.query_points(lookup).await.unwrap_err(), &["lookup", "9"]);
    for answer in [
        daemon.post("/v1/maps/a/occupancy", json!({"points": row(1), "level": 4})).await,
        daemon.post_bytes("/v1/maps/a/occupancy?level=4", bytes_of(&row(1))).await,
        daemon.post("/v1/maps/a/deletions", json!({"points": row(1), "level": 4})).await,
        daemon.get("/v1/maps/a/voxels?level=4").await,
    ] {
        assert_refused(refused(answer).await, &["level", "4"]);
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn bytes_that_are_no_whole_points_are_refused() {
    let daemon = daemon().await;
    let mut bytes = bytes_of(&row(3));
    bytes.pop();
    let points = |xyz_f32le: Vec<u8>, xyz: Vec<f32>| Some(pb::Points { xyz_f32le: xyz_f32le.into(), xyz });
    let mut planner = daemon.occupancy().await;
    for (points, words) in [
        (points(bytes.clone(), vec![]), ["12-byte", "35 bytes"]),
        (points(vec![], vec![1.0; 4]), ["three numbers", "4 numbers"]),
        (points(vec![0; 12], vec![1.0; 3]), ["xyz_f32le", "both"]),
        (None, ["points", "missing"]),
    ] {
        let query = pb::QueryPointsRequest { points, ..query_pb("a", &[]) };
        assert_invalid(&planner.query_points(query).await.unwrap_err(), &words);
    }
    for route in ["occupancy", "deletions", "scans?robot=r", "alignment?robot=r"] {
        let answer = daemon.post_bytes(&format!("/v1/maps/a/{route}"), bytes.clone()).await;
        assert_refused(refused(answer).await, &["body", "12-byte", "35 bytes"]);
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn json_that_is_not_what_a_route_takes_is_refused_with_its_place() {
    let daemon = daemon().await;
    for (body, words) in [
        (r#"{"points": [[1, 2, 3]"#, ["line 1", "EOF"]),
        (r#"{"points": [[1, 2]]}"#, ["line 1", "length 2"]),
        (r#"{"points": [[1, 2, "x"]]}"#, ["line 1", "number"]),
        ("{\n\"points\": [], \"level\": -1}", ["line 2", "whole number"]),
        (r#"{"points": [], "lookup": "maybe"}"#, ["maybe", "exact"]),
        (r#"{"points": [], "color": 1}"#, ["color", "points"]),
        (r#"{"level": 0}"#, ["missing field", "points"]),
        ("", ["line 1", "EOF"]),
    ] {
        let post =
            client().post(daemon.url("/v1/maps/a/occupancy")).header("content-type", "application/json");
        assert_refused(refused(post.body(body).send().await.unwrap()).await, &words);
    }
    for (parameters, words) in [
        ("level=x", ["level", "whole number"]),
        ("color=1", ["color", "unknown"]),
        ("lookup=maybe", ["lookup", "maybe"]),
        ("min_revision=-1", ["min_revision", "whole number"]),
        ("map_uuid=1", ["map_uuid", "\"1\""]),
    ] {
        let route = format!("/v1/maps/a/occupancy?{parameters}");
        assert_refused(refused(daemon.post_bytes(&route, bytes_of(&row(1))).await).await, &words);
    }
    let both = daemon.post("/v1/maps/a/occupancy?level=1", json!({"points": row(1)})).await;
    assert_refused(refused(both).await, &["level=1", "body"]);
    let nameless = daemon.post_bytes("/v1/maps/a/scans?scan_id=1", bytes_of(&row(1))).await;
    assert_refused(refused(nameless).await, &["robot"]);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn another_content_type_is_refused_naming_those_that_are_taken() {
    let daemon = daemon().await;
    for content_type in ["text/plain", "application/x-www-form-urlencoded", ""] {
        for route in ["occupancy", "scans?robot=r", "deletions"] {
            let post = client().post(daemon.url(&format!("/v1/maps/a/{route}")));
            let post = post.header("content-type", content_type).body("{}");
            let answer = post.send().await.unwrap();
            assert_eq!(answer.status(), StatusCode::UNSUPPORTED_MEDIA_TYPE);
            let error = json_of(answer).await;
            let words = ["application/json", "application/octet-stream", content_type];
            assert_says(error["detail"].as_str().unwrap_or_default(), &words);
        }
    }
    let charset = client().post(daemon.url("/v1/maps/a/occupancy"));
    let charset = charset.header("content-type", "Application/JSON; charset=utf-8");
    let answer = charset.body(json!({"points": row(1)}).to_string()).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn a_scan_without_a_usable_point_is_refused() {
    let daemon = daemon().await;
    let nothing = [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [0.0, f32::NAN, 0.0]];
    let mut robot = daemon.mapping().await;
    assert_invalid(&robot.insert_scan(scan_pb("a", "r", &nothing)).await.unwrap_err(), &["points", "3"]);
    let aligned = pb::InsertScanRequest { at_guess: false, ..scan_pb("a", "r", &nothing) };
    assert_invalid(&robot.insert_scan(aligned).await.unwrap_err(), &["points", "3"]);
    let mut strict = scan_pb("a", "r", &[row(1)[0], [f32::NAN; 3]]);
    strict.scan.as_mut().unwrap().strict = true;
    assert_invalid(&robot.insert_scan(strict).await.unwrap_err(), &["points[1]"]);
    for route in ["scans", "alignment"] {
        let json = json!({"robot": "r", "points": [[null, null, null]], "guess": identity_json()});
        let answer = daemon.post(&format!("/v1/maps/a/{route}"), json).await;
        assert_refused(refused(answer).await, &["points"]);
        let route = format!("/v1/maps/a/{route}?robot=r&guess=0,0,0,0,0,0,1");
        assert_refused(refused(daemon.post_bytes(&route, bytes_of(&nothing)).await).await, &["points", "3"]);
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn regions_and_robots_that_are_none_are_named() {
    let daemon = daemon().await;
    let mut robot = daemon.mapping().await;
    let upside_down = pb::Box { min_m: Some([1.0; 3].into()), max_m: Some([0.0; 3].into()) };
    let region = pb::Region { shape: Some(pb::region::Shape::Box(upside_down)) };
    let deletion = pb::DeleteVoxelsRequest {
        map: "a".into(),
        target: Some(Target::Region(region)),
        ..Default::default()
    };
    assert_invalid(&robot.delete_voxels(deletion).await.unwrap_err(), &["box.min_m", "box.max_m"]);
    for (body, words) in [
        (json!({"box": {"min_m": [1, 1, 1], "max_m": [0, 0, 0]}}), ["box.min_m", "box.max_m"]),
        (json!({"sphere": {"center_m": [0, 0, 0], "radius_m": -1}}), ["sphere.radius_m", "-1"]),
        (json!({"voxels": [[0, 0, 0], [0, 2_000_000, 0]]}), ["voxels[1]", "2000000"]),
    ] {
        let answer = daemon.post("/v1/maps/a/deletions", body).await;
        assert_refused(refused(answer).await, &words);
    }
    let nameless = pb::InsertScanRequest { guess: guess_pb([0.0; 3]), ..scan_pb("a", "r/1", &row(1)) };
    assert_invalid(&robot.insert_scan(nameless).await.unwrap_err(), &["scan.robot", "r/1"]);
    let answer = daemon.post("/v1/maps/a/scans", json!({"robot": "", "points": row(1)})).await;
    assert_refused(refused(answer).await, &["robot", "1 to 64"]);
    let answer = daemon.get("/v1/maps/a/trajectory?robot=r%2f1").await;
    assert_refused(refused(answer).await, &["robot", "r/1"]);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn what_is_no_gravity_and_no_covariance_is_refused_with_its_numbers() {
    let daemon = daemon().await;
    for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 0.0]] {
        let gravity = pb::Vector3 { x: bad[0], y: bad[1], z: bad[2] };
        let mut scan = scan_pb("a", "r", &row(1));
        scan.scan.as_mut().unwrap().gravity_in_sensor = Some(gravity);
        let status = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
        assert_invalid(&status, &["scan", "gravity_in_sensor", &format!("{bad:?}")]);
    }
    let mut asymmetric = vec![0.0; 36];
    asymmetric[1] = 0.5;
    let mut negative = vec![0.0; 36];
    negative[35] = -2.0;
    for (bad, words) in [
        (vec![1.0; 35], "36 numbers"),
        (vec![f64::NAN; 36], "finite, got NaN in row 0"),
        (asymmetric.clone(), "symmetric, got 0 in row 1, column 0, and 0.5"),
        (negative.clone(), "positive semidefinite, got a variance of -2"),
    ] {
        let guess = pb::Guess { covariance: bad, ..Default::default() };
        let scan = pb::InsertScanRequest { guess: Some(guess), ..scan_pb("a", "r", &row(1)) };
        let status = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
        assert_invalid(&status, &["guess", "covariance", words]);
    }
    for (field, value, words) in [
        ("gravity_in_sensor", json!([0, 0, 0]), "gravity_in_sensor must be a finite direction"),
        ("guess_covariance", json!([1, 2, 3]), "36 numbers, 6 rows of 6, got 3"),
        ("guess_covariance", json!(asymmetric), "symmetric"),
        ("guess_covariance", json!(negative), "positive semidefinite"),
    ] {
        for route in ["scans", "alignment"] {
            let mut body = json!({"robot": "r", "points": row(1)});
            body[field] = value.clone();
            let answer = daemon.post(&format!("/v1/maps/a/{route}"), body).await;
            assert_refused(refused(answer).await, &[words]);
        }
    }
    for (query, words) in [
        ("gravity_in_sensor=0,0,0", "gravity_in_sensor must be a finite direction"),
        ("gravity_in_sensor=0,0", "gravity_in_sensor must be 3 numbers"),
        ("guess_covariance=1,2", "guess_covariance must be 36 numbers"),
    ] {
        let route = format!("/v1/maps/a/scans?robot=r&{query}");
        assert_refused(refused(daemon.post_bytes(&route, bytes_of(&row(1))).await).await, &[words]);
    }
    assert_unchanged(&daemon).await;
}
