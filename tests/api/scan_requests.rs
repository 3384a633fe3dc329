//! What a robot can say with a scan, and what it is told: guesses, points that do not count, force, foreground, and
//! standing still.

use mrol::config::RobotConfig;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::json;

use crate::support::daemon::{Daemon, bits_of, bytes_of, corner, guess_pb, json_of, row, scan_pb};

/// The corner as a sensor sees it that stands at `at`, and a scan of it that is to be aligned.
fn seen_from(at: [f32; 3]) -> Vec<[f32; 3]> {
    corner().into_iter().map(|point| [0, 1, 2].map(|axis| point[axis] - at[axis])).collect()
}

fn to_align(robot: &str, points: &[[f32; 3]], guess: Option<pb::Guess>) -> pb::InsertScanRequest {
    pb::InsertScanRequest { guess, at_guess: false, ..scan_pb("a", robot, points) }
}

fn place(answer: &pb::InsertScanResponse) -> [f64; 3] {
    let pose = answer.alignment.as_ref().unwrap().map_from_sensor.unwrap();
    pose.translation_m.unwrap().into()
}

fn is_near(found: [f64; 3], expected: [f64; 3]) -> bool {
    found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.01)
}

#[tokio::test]
async fn a_constant_velocity_goes_on_as_the_last_two_scans_went() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    for x in [0.0, 0.3] {
        robot
            .insert_scan(pb::InsertScanRequest {
                guess: guess_pb([x, 0.0, 0.0]),
                ..scan_pb("a", "r", &corner())
            })
            .await
            .unwrap();
    }
    let guess = pb::Guess { kind: Some(pb::guess::Kind::ConstantVelocity(true)), ..Default::default() };
    // Taken at its guess, so that the answer is the guess.
    let request = pb::InsertScanRequest { guess: Some(guess), ..scan_pb("a", "r", &corner()) };
    let answer = robot.insert_scan(request).await.unwrap().into_inner();
    assert!(is_near(place(&answer), [0.6, 0.0, 0.0]), "{answer:?}");

    let route = "/v1/maps/a/scans?robot=r&align=false&constant_velocity=true";
    let answer = json_of(daemon.post_bytes(route, bytes_of(&corner())).await).await;
    assert!((answer["map_from_sensor"]["translation_m"][0].as_f64().unwrap() - 0.9).abs() < 1e-9, "{answer}");
}

#[tokio::test]
async fn points_that_seem_to_be_in_millimeters_are_told_where_a_scan_is_refused_or_the_first_one() {
    let daemon = Daemon::start().await;
    let insert = async |map: &str, points: &[[f32; 3]], more: &str| {
        let route = format!("/v1/maps/{map}/scans?robot=r{more}");
        let answer = json_of(daemon.post_bytes(&route, bytes_of(points)).await).await;
        (answer["accepted"].as_bool().unwrap(), answer["reason"].as_str().unwrap().to_owned())
    };
    let millimeters: Vec<_> = corner().into_iter().map(|point| point.map(|c| 1000.0 * c)).collect();
    daemon.make_map("a").await;
    let (accepted, reason) = insert("a", &millimeters, "").await;
    let expected = "the first scan of the map; the median range of its points is";
    assert!(accepted && reason.starts_with(expected), "{reason}");
    assert!(reason.contains("are they in millimeters?"), "{reason}");
    let (accepted, reason) = insert("a", &millimeters, "&align=false").await;
    assert!(accepted && !reason.contains("millimeters"), "{reason}");

    daemon.make_map("b").await;
    for more in ["", "&align=false"] {
        let (accepted, reason) = insert("b", &corner(), more).await;
        assert!(accepted && !reason.contains("millimeters"), "{reason}");
    }
    let (accepted, reason) = insert("b", &millimeters, "").await;
    assert!(!accepted && reason.contains("are they in millimeters?"), "{reason}");
}

#[tokio::test]
async fn points_out_of_range_or_of_the_robots_body_do_not_count() {
    let daemon = Daemon::start_with(|config| {
        let far = RobotConfig { range_max_m: Some(5.0), ..RobotConfig::default() };
        config.robots.insert("short".into(), far);
    })
    .await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    let mut points = corner();
    points.extend([[0.3, 0.3, 0.3], [9.0, 9.0, 9.0]]);
    let body = pb::Box { min_m: Some([0.2; 3].into()), max_m: Some([0.4; 3].into()) };
    let mut request = scan_pb("a", "r", &points);
    request.scan.as_mut().unwrap().body = Some(body);
    request.scan.as_mut().unwrap().range_max_m = Some(6.0);
    let answer = robot.insert_scan(request).await.unwrap().into_inner();
    assert_eq!(answer.alignment.unwrap().points_skipped, 2);
    // The settings speak where the request does not.
    let answer = robot.insert_scan(scan_pb("a", "short", &points)).await.unwrap().into_inner();
    assert_eq!(answer.alignment.unwrap().points_skipped, 1);

    let mut nothing = scan_pb("a", "r", &points);
    nothing.scan.as_mut().unwrap().range_min_m = Some(100.0);
    let refused = robot.insert_scan(nothing).await.unwrap_err();
    assert!(refused.message().contains("range_min_m"), "{refused}");
    let route = "/v1/maps/a/scans?robot=r&range_min_m=3&range_max_m=2";
    let refused = json_of(daemon.post_bytes(route, bytes_of(&points)).await).await;
    assert_eq!(refused["reason"], "bad_filter", "{refused}");
}

#[tokio::test]
async fn the_first_scan_of_a_map_lies_as_its_robot_s_sensor_is_mounted_where_no_guess_says() {
    let daemon = Daemon::start_with(|config| {
        let camera: RobotConfig =
            serde_json::from_value(json!({"axes": "optical", "sensor_height_m": 1.2})).unwrap();
        config.robots.insert("camera".into(), camera);
    })
    .await;
    let pose_of = async |robot: &str, map: &str, guess: &str| {
        daemon.make_map(map).await;
        let route = format!("/v1/maps/{map}/scans?robot={robot}{guess}");
        let answer = json_of(daemon.post_bytes(&route, bytes_of(&corner())).await).await;
        let pose = &answer["map_from_sensor"];
        (pose["translation_m"].clone(), pose["rotation_xyzw"].clone())
    };
    let upright = (json!([0.0, 0.0, 1.2]), json!([-0.5, 0.5, -0.5, 0.5]));
    assert_eq!(pose_of("camera", "a", "").await, upright);
    let level = |z: f64| (json!([0.0, 0.0, z]), json!([0.0, 0.0, 0.0, 1.0]));
    assert_eq!(pose_of("lidar", "b", "").await, level(0.0));
    assert_eq!(pose_of("camera", "c", "&guess=0,0,3,0,0,0,1").await, level(3.0));
}

#[tokio::test]
async fn directions_without_a_return_are_free_up_to_where_the_settings_say() {
    let daemon = Daemon::start_with(|config| {
        let nothing = RobotConfig { no_return_m: Some(12.0), ..RobotConfig::default() };
        config.robots.insert("knows".into(), nothing);
    })
    .await;
    // A wall 5 m ahead, with a wide opening on one side in which nothing is met: the driver says 40 m.
    let points: Vec<[f32; 3]> = (-40..40)
        .flat_map(|y| (-20..20).map(move |z| [1.0, y as f32 * 0.01, z as f32 * 0.01]))
        .map(|direction| direction.map(|c| c * if direction[1] < 0.0 { 5.0 } else { 40.0 }))
        .collect();
    let asked = json!({"points": [[10.0, 2.0, 0.0], [13.0, 2.6, 0.0], [3.0, -0.6, 0.0], [5.5, -1.0, 0.0]]});
    for (robot, free, voxels_beyond) in
        [("knows", [true, false, true, false], false), ("r", [true, true, true, false], true)]
    {
        daemon.make_map(robot).await;
        let answer = json_of(
            daemon.post_bytes(&format!("/v1/maps/{robot}/scans?robot={robot}"), bytes_of(&points)).await,
        )
        .await;
        assert_eq!(answer["points_skipped"], if robot == "knows" { 1600 } else { 0 }, "{answer}");
        let told =
            json_of(daemon.post(&format!("/v1/maps/{robot}/classification"), asked.clone()).await).await;
        assert_eq!(told["free"], json!(free), "{robot}: {told}");
        let far = json!({"points": [points.last()]});
        let found = json_of(daemon.post(&format!("/v1/maps/{robot}/occupancy"), far).await).await;
        assert_eq!(found["occupied"], json!([voxels_beyond]), "{robot}: {found}");
    }
}

#[tokio::test]
async fn a_scan_that_is_not_accepted_is_added_by_force_alone() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    let mut robot = daemon.mapping().await;
    let elsewhere = to_align("r", &corner(), guess_pb([40.0, 0.0, 0.0]));
    let refused = robot.insert_scan(elsewhere.clone()).await.unwrap().into_inner();
    assert!(!refused.accepted && refused.new_voxels == 0);
    let forced = pb::InsertScanRequest { force: true, ..elsewhere };
    let forced = robot.insert_scan(forced).await.unwrap().into_inner();
    assert!(forced.accepted && forced.new_voxels > 0);
    assert_eq!(forced.alignment.unwrap().verdict, i32::from(pb::Verdict::LowOverlap));
    assert_eq!(forced.version.unwrap().revision, 2);
}

#[tokio::test]
async fn what_is_in_front_of_the_map_is_told_point_by_point() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    let mut points = seen_from([0.1, 0.0, 0.0]);
    let newcomers = [[0.93f32, 0.95, 0.95], [f32::NAN, 0.0, 0.0], [0.93, 0.95, 1.05]];
    let walls = points.len();
    points.extend(newcomers);
    let pb::InsertScanRequest { map, scan, guess, .. } = to_align("r", &points, guess_pb([0.08, 0.0, 0.0]));
    let request = pb::AlignScanRequest { map, scan, guess, foreground_level: Some(0), ..Default::default() };
    let mut robot = daemon.mapping().await;
    let answer = robot.align_scan(request).await.unwrap().into_inner();
    let bits = bits_of(&answer.foreground, points.len());
    let new: Vec<usize> = (0..points.len()).filter(|&i| bits[i]).collect();
    assert!(new.ends_with(&[walls, walls + 2]) && !bits[walls + 1], "{new:?}");
    assert_eq!(answer.foreground_points, new.len() as u64);
    // A wall's points next to a voxel's border may fall beyond it; no more than a few.
    assert!(new.len() < walls / 20, "{}", new.len());

    let json: Vec<_> = points.iter().map(|p| p.map(|c| c.is_finite().then_some(c))).collect();
    let guess = json!({"translation_m": [0.08, 0.0, 0.0], "rotation_xyzw": [0.0, 0.0, 0.0, 1.0]});
    let body = json!({"robot": "r", "points": json, "guess": guess, "foreground_level": 0});
    let answer = json_of(daemon.post("/v1/maps/a/alignment", body).await).await;
    let told: Vec<usize> = serde_json::from_value(answer["foreground"].clone()).unwrap();
    assert_eq!(told, new);
    let body = json!({"robot": "r", "points": json, "foreground_level": 9});
    let refused = json_of(daemon.post("/v1/maps/a/alignment", body).await).await;
    assert_eq!(refused["reason"], "level_out_of_range", "{refused}");
    assert!(
        refused["detail"].as_str().unwrap().starts_with("foreground_level: level must lie in"),
        "{refused}"
    );
}

#[tokio::test]
async fn a_robot_that_stands_still_does_not_grow_its_trajectory() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    let first = robot.insert_scan(to_align("r", &corner(), None)).await.unwrap().into_inner();
    assert!(first.accepted && !first.stationary);
    for _ in 0..5 {
        let again = robot.insert_scan(to_align("r", &corner(), None)).await.unwrap().into_inner();
        assert!(again.accepted && again.stationary && again.new_voxels == 0, "{again:?}");
        assert_eq!(again.version.unwrap().revision, 1);
    }
    // Something new before it is worth keeping, and so is another place.
    let mut with_box = corner();
    with_box.extend((0..400).map(|i| [1.0 + (i % 20) as f32 * 0.02, 1.0 + (i / 20) as f32 * 0.02, 0.5]));
    let changed = robot.insert_scan(to_align("r", &with_box, None)).await.unwrap().into_inner();
    assert!(changed.accepted && !changed.stationary && changed.new_voxels > 10, "{changed:?}");
    let moved = to_align("r", &seen_from([0.2, 0.0, 0.0]), guess_pb([0.2, 0.0, 0.0]));
    let moved = robot.insert_scan(moved).await.unwrap().into_inner();
    assert!(moved.accepted && !moved.stationary && is_near(place(&moved), [0.2, 0.0, 0.0]), "{moved:?}");
    assert_eq!(moved.version.unwrap().revision, 3);
}

#[tokio::test]
async fn what_an_operation_does_not_take_is_refused_and_not_passed_over() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let scan = json!({"robot": "r", "points": row(3)});
    for (path, field) in [("scans", "foreground_level"), ("alignment", "force")] {
        let mut body = scan.clone();
        body[field] = if field == "force" { true.into() } else { 0.into() };
        let refused = daemon.post(&format!("/v1/maps/a/{path}"), body).await;
        assert_eq!(refused.status(), StatusCode::BAD_REQUEST);
        let refused = json_of(refused).await;
        assert_eq!(refused["reason"], "unexpected_field");
        assert!(refused["detail"].as_str().unwrap().contains(field), "{refused}");
    }
    assert_eq!(daemon.contents("a").await.0, 0);
}

#[tokio::test]
async fn points_at_0_0_0_are_skipped_and_named_unless_the_settings_keep_them() {
    let daemon = Daemon::start_with(|config| {
        config.robots.insert("keeps".into(), RobotConfig { keep_zeros: true, ..RobotConfig::default() });
    })
    .await;
    let zeros = |points: &[[f32; 3]], every: usize| -> Vec<[f32; 3]> {
        points.iter().enumerate().map(|(i, p)| if i % every == 0 { [0.0, -0.0, 0.0] } else { *p }).collect()
    };
    let seen = seen_from([0.01; 3]);
    for (robot, occupied, skipped) in [("r", false, 2500), ("keeps", true, 0)] {
        daemon.make_map(robot).await;
        let route = format!("/v1/maps/{robot}/scans?robot={robot}&align=false");
        let answer = json_of(daemon.post_bytes(&route, bytes_of(&zeros(&seen, 3))).await).await;
        assert_eq!(answer["points_skipped"], skipped, "{answer}");
        let at_sensor = json!({"points": [[0.0, 0.0, 0.0]]});
        let found = json_of(daemon.post(&format!("/v1/maps/{robot}/occupancy"), at_sensor).await).await;
        assert_eq!(found["occupied"], json!([occupied]), "{robot}: {found}");
    }
    // Three of four points at 0 0 0 do not keep a scan from its map.
    let most: Vec<[f32; 3]> =
        seen.iter().enumerate().map(|(i, p)| if i % 4 == 0 { *p } else { [0.0; 3] }).collect();
    let answer = json_of(daemon.post_bytes("/v1/maps/r/scans?robot=r", bytes_of(&most)).await).await;
    assert_eq!((&answer["accepted"], &answer["points_skipped"]), (&json!(true), &json!(5625)), "{answer}");
    // A scan that is refused says so.
    let elsewhere: Vec<[f32; 3]> = (0..3000)
        .map(|i| if i % 2 == 0 { [0.0; 3] } else { [20.0 + i as f32 * 0.01, (i % 7) as f32, 5.0] })
        .collect();
    let answer = json_of(daemon.post_bytes("/v1/maps/r/scans?robot=r", bytes_of(&elsewhere)).await).await;
    assert_eq!(answer["accepted"], json!(false), "{answer}");
    let reason = answer["reason"].as_str().unwrap();
    assert!(reason.contains("1500 of 3000 points skipped: 1500 at 0 0 0"), "{reason}");
    let nothing = daemon.post_bytes("/v1/maps/r/scans?robot=r", bytes_of(&[[0.0; 3]; 5])).await;
    let nothing = json_of(nothing).await;
    assert_eq!(nothing["reason"], "no_returns", "{nothing}");
    assert!(nothing["detail"].as_str().unwrap().contains("5 are at 0 0 0"), "{nothing}");
}

#[tokio::test]
async fn a_scan_of_which_half_lies_beyond_a_range_says_so() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut points = row(100);
    points.extend((0..100).map(|i| [1e9, i as f32, 0.0]));
    let answer =
        json_of(daemon.post_bytes("/v1/maps/a/scans?robot=r&align=false", bytes_of(&points)).await).await;
    assert_eq!((&answer["accepted"], &answer["points_skipped"]), (&json!(true), &json!(100)), "{answer}");
    let reason = answer["reason"].as_str().unwrap();
    assert!(reason.contains("100 beyond the map's range (half of the scan or more"), "{reason}");
}

#[tokio::test]
async fn times_of_points_that_are_skipped_may_be_anything() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let route = "/v1/maps/a/scans?robot=r&timestamp_ns=1&point_times=true&align=false";
    for from_sweep_start in [false, true] {
        for wrong in [f32::NAN, f32::INFINITY, f32::MAX, -4e9, 4_294.967] {
            let times = |wrong_at: usize| -> Vec<u8> {
                (0..4)
                    .flat_map(|i| if i == wrong_at { wrong } else { 0.01 * i as f32 }.to_le_bytes())
                    .collect()
            };
            let points = [[1.0, 2.0, 3.0], [f32::NAN, 0.0, 0.0], [2.0, 2.0, 3.0], [0.0; 3]];
            for (wrong_at, is_taken) in [(0, false), (1, true), (2, false), (3, true)] {
                let body = [bytes_of(&points), times(wrong_at)].concat();
                let route = format!("{route}&point_times_from_sweep_start={from_sweep_start}");
                let answer = json_of(daemon.post_bytes(&route, body).await).await;
                let expected = if is_taken { json!(null) } else { json!("bad_point_times") };
                let reason = if is_taken { &json!(null) } else { &answer["reason"] };
                assert_eq!(reason, &expected, "{wrong} at {wrong_at}: {answer}");
                assert_eq!(answer["accepted"] == json!(true), is_taken, "{wrong} at {wrong_at}: {answer}");
            }
        }
    }
}
