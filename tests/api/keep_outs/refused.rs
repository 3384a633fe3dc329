//! What is no keep-out, or one too many.

use super::{ROUTE, ball, client_of, map, put};

use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, json_of, row};

#[tokio::test]
async fn what_is_no_keep_out_is_refused_by_name_and_makes_no_revision() {
    let daemon = Daemon::start_with(|config| {
        config.limits.keep_outs_max = 2;
        config.limits.keep_out_corners_max = 4;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    let sphere = json!({"center_m": [0, 0, 0], "radius_m": 1});
    let prism = |corners: Value| json!({"prism": {"corners_m": corners, "z_from_m": 0, "z_to_m": 1}});
    let million: Vec<[f64; 2]> = (0..1_000_000).map(|i| [f64::from(i), 0.0]).collect();
    let many: Vec<[f64; 2]> = (0..5).map(|i| [f64::from(i), f64::from(i * i)]).collect();
    for (body, reason, words) in [
        (json!({}), "ambiguous_target", "exactly one of box, sphere, oriented_box and prism"),
        (
            json!({"sphere": sphere, "box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}}),
            "ambiguous_target",
            "one of",
        ),
        (json!({"sphere": {"center_m": [0, 0, 0], "radius_m": -1}}), "bad_region", "radius_m"),
        (json!({"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1e13]}}), "bad_keep_out", "within 1e12 m"),
        (prism(json!([[0, 0], [1, 0]])), "bad_keep_out", "3 to 64 corners, got 2"),
        (prism(json!(million)), "bad_keep_out", "3 to 64 corners, got 1000000"),
        (prism(json!(many)), "bad_keep_out", "5 corners, keep_out_corners_max is 4"),
        (prism(json!([[0, 0], [1, 1], [1, 0], [0, 1]])), "bad_keep_out", "crosses or touches"),
        (prism(json!([[0, 0], [1, 1], [0, 0]])), "bad_keep_out", "are the same"),
        (prism(json!([[0, 0], [1, 1], [2, 2]])), "bad_keep_out", "on one line"),
        (json!({"sphere": sphere, "expires_at_ns": 7}), "bad_expiry", "must lie in the future, got 7"),
        (json!({"sphere": sphere, "request_id": "a b"}), "bad_name", "request_id"),
        (json!({"sphere": sphere, "hue": 1}), "bad_json", "unknown field"),
    ] {
        let refused = daemon.put(&format!("{ROUTE}/dock"), body).await;
        assert_eq!(refused.status(), StatusCode::BAD_REQUEST);
        let refused = json_of(refused).await;
        assert_eq!(refused["reason"], reason, "{refused}");
        assert!(refused["detail"].as_str().unwrap().contains(words), "{refused}");
    }
    for bad in ["Dock", "a.b", "%20", &"x".repeat(65), &"x".repeat(5000)] {
        let refused = json_of(daemon.put(&format!("{ROUTE}/{bad}"), json!({"sphere": sphere})).await).await;
        assert_eq!(refused["reason"], "bad_name", "{refused}");
        assert!(refused["detail"].as_str().unwrap().len() < 300);
    }
    let mut mapping = daemon.mapping().await;
    let mut over_grpc = async |corners_m: Vec<f64>| {
        let prism = pb::Prism { corners_m, z_from_m: 0.0, z_to_m: 1.0 };
        let shape = Some(pb::KeepOutShape { shape: Some(pb::keep_out_shape::Shape::Prism(prism)) });
        let request =
            pb::PutKeepOutRequest { map: "a".into(), name: "dock".into(), shape, ..Default::default() };
        mapping.put_keep_out(request).await.unwrap_err()
    };
    for (corners, words) in [
        (vec![0.0, 0.0, f64::NAN, 0.0, 1.0, 1.0], "corners_m[1] must be finite"),
        (vec![0.0, 0.0, f64::INFINITY, 0.0, 1.0, 1.0], "corners_m[1] must be finite"),
        (vec![0.0; 7], "two numbers a corner"),
        (vec![0.5; 2_000_000], "3 to 64 corners, got 1000000"),
    ] {
        let refused = over_grpc(corners).await;
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
        assert!(refused.message().contains(words), "{refused}");
    }
    for text in ["one", "two", "two"] {
        assert_eq!(
            daemon.put(&format!("{ROUTE}/{text}"), json!({"sphere": sphere})).await.status(),
            StatusCode::OK
        );
    }
    let full = daemon.put(&format!("{ROUTE}/three"), json!({"sphere": sphere})).await;
    assert_eq!(full.status(), StatusCode::TOO_MANY_REQUESTS);
    let full = json_of(full).await;
    assert_eq!(full["reason"], "too_many_keep_outs");
    assert!(full["detail"].as_str().unwrap().contains("2 keep-outs, keep_outs_max is 2"), "{full}");
    assert_eq!(daemon.contents("a").await.0, 4);
}

#[tokio::test]
async fn the_two_hundred_and_fifty_seventh_keep_out_is_one_too_many() {
    let daemon = Daemon::start_with(|config| config.data_dir = "".into()).await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    for i in 0..256 {
        client.put_keep_out(&map("a"), put(&format!("k{i}"), ball([0.0; 3], 1.0))).await.unwrap();
    }
    let full = client.put_keep_out(&map("a"), put("one-more", ball([0.0; 3], 1.0))).await.unwrap_err();
    assert!(full.to_string().contains("256 keep-outs, keep_outs_max is 256"), "{full}");
    assert_eq!(client.list_keep_outs(&map("a")).await.unwrap().keep_outs.len(), 256);
}
