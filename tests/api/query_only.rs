//! Maps without filters and without moments: made, described, asked, kept and restored.

use mrol::client::{Client, ClientError, NewFilter, NewMap};
use mrol::map::MapName;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, bytes_of, corner, identity_json, json_of, row};

fn settings() -> Value {
    json!({"resolution_m": 0.1, "levels": 4, "filter": "none", "moments": false})
}

fn new_map() -> NewMap {
    NewMap { levels: Some(4), filter: NewFilter::NoFilter, moments: Some(false), ..NewMap::of(0.1) }
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

fn a() -> MapName {
    MapName::new("a").unwrap()
}

#[tokio::test]
async fn its_description_has_no_filters_and_no_moments_in_both_protocols() {
    let daemon = Daemon::start().await;
    assert_eq!(daemon.put("/v1/maps/a", settings()).await.status(), StatusCode::CREATED);
    daemon.put_in("a", &corner()).await;

    let described = json_of(daemon.get("/v1/maps/a").await).await;
    assert_eq!(described["settings"], settings());
    assert_eq!(described["moment_bytes"], 0);
    let levels = described["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 4);
    for level in levels {
        let keys: Vec<_> = level.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, ["level", "resolution_m", "voxels"]);
        assert!(level["voxels"].as_u64().unwrap() > 0);
    }

    let info = client_of(&daemon).await.map_info(&a()).await.unwrap();
    assert_eq!((info.settings.filter, info.settings.moments, info.moment_bytes), (None, false, 0));
    assert!(info.levels.iter().all(|level| level.filter.is_none() && level.voxels > 0));
    assert_eq!(daemon.metric(r#"mrol_map_filter_bytes{map="a",level="0",part="plane"}"#).await, None);
}

#[tokio::test]
async fn making_it_again_is_fine_and_with_filters_or_moments_a_conflict() {
    let daemon = Daemon::start().await;
    let client = client_of(&daemon).await;
    assert!(client.create_map(&a(), new_map()).await.unwrap().1);
    assert!(!client.create_map(&a(), new_map()).await.unwrap().1);
    assert_eq!(daemon.put("/v1/maps/a", settings()).await.status(), StatusCode::OK);
    let (usual, without_moments) = (NewFilter::default(), Some(false));
    for other in [
        NewMap { filter: usual, ..new_map() },
        NewMap { moments: None, ..new_map() },
        NewMap { filter: usual, moments: without_moments, ..new_map() },
    ] {
        let refused = client.create_map(&a(), other).await.unwrap_err();
        let ClientError::Refused { reason, message, .. } = refused else { panic!("{refused}") };
        assert_eq!(reason.as_deref(), Some("map_exists"));
        assert!(message.contains("no filter, no moments, not with"), "{message}");
    }
}

#[tokio::test]
async fn a_filter_beside_none_is_refused_and_so_is_what_is_neither() {
    let daemon = Daemon::start().await;
    let settings = pb::MapSettings {
        resolution_m: 0.1,
        filter: Some(pb::FilterSettings::default()),
        ..Default::default()
    };
    let request = pb::CreateMapRequest {
        map: "a".into(),
        settings: Some(pb::MapSettings { no_filter: true, ..settings }),
    };
    let refused = daemon.maps().await.create_map(request).await.unwrap_err();
    assert_eq!(refused.code(), tonic::Code::InvalidArgument);
    assert!(refused.message().contains("settings.no_filter"), "{}", refused.message());
    for filter in [json!("some"), json!(null), json!(false), json!([2, 14.0])] {
        let body = json!({"resolution_m": 0.1, "filter": filter});
        let refused = daemon.put("/v1/maps/a", body).await;
        assert_eq!(refused.status(), StatusCode::BAD_REQUEST, "{filter}");
    }
}

#[tokio::test]
async fn bloom_is_answered_by_the_exact_set() {
    let daemon = Daemon::start().await;
    daemon.put("/v1/maps/a", settings()).await;
    daemon.put_in("a", &row(20)).await;
    let points: Vec<_> = (0..4000).map(|i| [i as f32 * 0.01, 0.0, (i % 7) as f32 * 0.1]).collect();
    let ask = async |lookup: &str| {
        let route = format!("/v1/maps/a/occupancy?lookup={lookup}");
        daemon.post_bytes(&route, bytes_of(&points)).await.bytes().await.unwrap()
    };
    let exact = ask("exact").await;
    assert_eq!(ask("bloom").await, exact);
    assert!(exact.iter().any(|byte| *byte != 0));
}

#[tokio::test]
async fn scans_are_aligned_by_overlap_and_undone_and_the_map_survives_a_restart() {
    let daemon = Daemon::start().await;
    daemon.put("/v1/maps/a", settings()).await;
    daemon.put_in("a", &corner()).await;
    let before = daemon.contents("a").await;
    let scan =
        json!({"robot": "r", "scan_id": 1, "points": corner(), "guess": identity_json(), "force": true});
    let aligned = json_of(daemon.post("/v1/maps/a/scans", scan).await).await;
    assert_eq!(aligned["verdict"], "accepted", "{aligned}");
    assert!(aligned["reason"].as_str().unwrap().contains("the map keeps no moments"), "{aligned}");
    let deleted = daemon
        .post("/v1/maps/a/deletions", json!({"box": {"min_m": [-9, -9, -9], "max_m": [9, 9, 9]}}))
        .await;
    assert_eq!(deleted.status(), StatusCode::OK, "{:?}", deleted.text().await);
    let undone = daemon.post("/v1/maps/a/undo", json!({"revision": 3})).await;
    assert_eq!(undone.status(), StatusCode::OK, "{:?}", undone.text().await);
    let undone = json_of(daemon.post("/v1/maps/a/undo", json!({"robot": "r", "scan_id": 1})).await).await;
    assert_eq!(undone["scans"], 1, "{undone}");
    let (_, voxels) = daemon.contents("a").await;
    assert_eq!(voxels, before.1);

    let data = daemon.stop().await;
    let daemon = Daemon::start_in(data, |_| ()).await;
    assert_eq!(daemon.contents("a").await.1, before.1);
    let described = json_of(daemon.get("/v1/maps/a").await).await;
    assert_eq!((&described["settings"], &described["moment_bytes"]), (&settings(), &json!(0)));
}

#[tokio::test]
async fn a_map_file_of_it_makes_such_a_map_again() {
    let daemon = Daemon::start().await;
    daemon.put("/v1/maps/a", settings()).await;
    daemon.put_in("a", &row(30)).await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    let request = crate::support::daemon::client().put(daemon.url("/v1/maps/b/snapshot"));
    let request = request.header("content-type", "application/octet-stream").body(file);
    assert_eq!(request.send().await.unwrap().status(), StatusCode::CREATED);
    let restored = json_of(daemon.get("/v1/maps/b").await).await;
    assert_eq!(restored["settings"], settings());
    assert_eq!(daemon.contents("b").await, daemon.contents("a").await);
}
