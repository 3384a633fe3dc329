//! Keep-outs over both protocols: put, replaced, removed, expired, listed; regarded by queries and listings that ask for it;
//! told to who watches, kept across restarts, and of no concern to anything else.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::map::{KeepOutAct, KeepOutChange, KeepOutName, KeepOutShape, Lookup, MapName, Prism, Region};
use mrol::service::{
    Cause, DeleteKeepOut, ListingRequest, PointQuery, PutKeepOut, WatchEvent, WatchForm, WatchRequest,
    WatchedSince,
};
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;

use crate::support::daemon::{Daemon, PATIENCE, bits_of, bytes_of, json_of, points_pb, row};

fn map(name: &str) -> MapName {
    MapName::new(name).unwrap()
}

fn name(text: &str) -> KeepOutName {
    KeepOutName::new(text).unwrap()
}

fn ball(center_m: [f64; 3], radius_m: f64) -> KeepOutShape {
    KeepOutShape::of_region(Region::ball(center_m, radius_m).unwrap()).unwrap()
}

fn put(text: &str, shape: KeepOutShape) -> PutKeepOut {
    PutKeepOut { name: name(text), shape, expires_at_ns: None, request_id: None }
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

fn now_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64
}

/// A server with a map `a` of ten voxels in a row.
async fn started() -> Daemon {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    daemon
}

async fn listed(daemon: &Daemon) -> Value {
    json_of(daemon.get("/v1/maps/a/keep-outs").await).await
}

async fn names(daemon: &Daemon) -> Vec<String> {
    let all = listed(daemon).await["keep_outs"].as_array().unwrap().clone();
    all.iter().map(|keep_out| keep_out["name"].as_str().unwrap().to_owned()).collect()
}

const ROUTE: &str = "/v1/maps/a/keep-outs";

#[tokio::test]
async fn a_keep_out_is_put_replaced_and_removed_each_by_a_revision_and_no_voxel_changes() {
    let daemon = started().await;
    let before = json_of(daemon.get("/v1/maps/a").await).await;
    let cube = json!({"box": {"min_m": [0, 0, 0], "max_m": [2.5, 2.5, 2]}});
    let made = json_of(daemon.put(&format!("{ROUTE}/dock"), cube).await).await;
    assert_eq!((&made["revision"], &made["replayed"]), (&json!(2), &json!(false)));
    assert_eq!(made["content_hash"], before["content_hash"]);
    let prism = json!({"corners_m": [[0, 0], [4, 0], [4, 3]], "z_from_m": -1, "z_to_m": 2.5});
    let at = now_ns() + 3_600_000_000_000;
    let body = json!({"prism": prism, "expires_at_ns": at});
    assert_eq!(json_of(daemon.put(&format!("{ROUTE}/dock"), body).await).await["revision"], 3);
    let pose = json!({"translation_m": [1.0, 2.0, 3.0], "rotation_xyzw": [0.0, 0.6, 0.0, 0.8]});
    let turned = json!({"map_from_box": pose, "size_m": [1.0, 2.0, 3.0]});
    daemon.put(&format!("{ROUTE}/arm"), json!({"oriented_box": turned})).await;
    let all = listed(&daemon).await;
    assert_eq!(all["revision"], 4);
    let prism = json!({"corners_m": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], "z_from_m": -1.0, "z_to_m": 2.5});
    let expected = json!([
        {"name": "arm", "oriented_box": turned, "made_revision": 4},
        {"name": "dock", "prism": prism, "made_revision": 3, "expires_at_ns": at},
    ]);
    assert_eq!(all["keep_outs"], expected);
    let gone = json_of(daemon.delete(&format!("{ROUTE}/dock")).await).await;
    assert_eq!((&gone["revision"], &gone["content_hash"]), (&json!(5), &before["content_hash"]));
    let absent = daemon.delete(&format!("{ROUTE}/dock")).await;
    assert_eq!(absent.status(), StatusCode::NOT_FOUND);
    assert_eq!(json_of(absent).await["reason"], "keep_out_not_found");
    assert_eq!((names(&daemon).await, daemon.contents("a").await.1.len()), (vec!["arm".to_owned()], 10));
}

#[tokio::test]
async fn the_client_puts_lists_and_removes_what_http_shows() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let prism = Prism::new(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], [-1.0, 2.5]).unwrap();
    let keep_out = PutKeepOut { expires_at_ns: Some(i64::MAX), ..put("stage", KeepOutShape::Prism(prism)) };
    let answer = client.put_keep_out(&map("a"), keep_out.clone()).await.unwrap();
    assert_eq!((answer.version.revision, answer.replayed), (2, false));
    let all = client.list_keep_outs(&map("a")).await.unwrap();
    assert_eq!((all.version, all.keep_outs.len()), (answer.version, 1));
    let kept = &all.keep_outs[0];
    assert_eq!((&kept.name, &kept.shape), (&keep_out.name, &keep_out.shape));
    assert_eq!((kept.expires_at_ns, kept.made_revision), (Some(i64::MAX), 2));
    assert_eq!(names(&daemon).await, ["stage"]);
    let removal = DeleteKeepOut { name: name("stage"), request_id: None };
    assert_eq!(client.delete_keep_out(&map("a"), removal.clone()).await.unwrap().version.revision, 3);
    let gone = client.delete_keep_out(&map("a"), removal).await.unwrap_err().to_string();
    assert!(gone.contains("map a has no keep-out stage"), "{gone}");
}

#[tokio::test]
async fn queries_and_listings_regard_keep_outs_where_they_are_asked_to() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("far", ball([5.0, 0.05, 0.05], 0.16))).await.unwrap();
    client.put_keep_out(&map("a"), put("over", ball([0.05, 0.05, 0.05], 0.11))).await.unwrap();
    let points = [[0.05, 0.05, 0.05], [5.0, 0.05, 0.15], [5.0, 0.05, 0.25], [0.05, 0.15, 0.05], [3.0; 3]];
    let bits = [("", [true, false, false, false, false]), ("true", [true, true, false, true, false])];
    for (keep_out, expected) in bits {
        let asks = !keep_out.is_empty();
        let message = pb::QueryPointsRequest {
            map: "a".into(),
            points: points_pb(&points),
            keep_out: asks,
            ..Default::default()
        };
        let answer = daemon.occupancy().await.query_points(message).await.unwrap().into_inner();
        assert_eq!(bits_of(&answer.occupied, 5), expected);
        assert_eq!(answer.points_occupied, expected.iter().filter(|bit| **bit).count() as u64);
        let body = json!({"points": points, "keep_out": asks});
        let answer = json_of(daemon.post("/v1/maps/a/occupancy", body).await).await;
        assert_eq!((&answer["occupied"], &answer["revision"]), (&json!(expected), &json!(3)));
        let route = format!("/v1/maps/a/occupancy?keep_out={asks}&lookup=bloom");
        let answer = daemon.post_bytes(&route, bytes_of(&points)).await.bytes().await.unwrap();
        assert_eq!(bits_of(&answer, 5), expected);
    }
    // The row, and the centers within 0.11 m of its first voxel and within 0.16 m of the middle of two others.
    let listed = json_of(daemon.get("/v1/maps/a/voxels?keep_out=true").await).await;
    let mut voxels: Vec<[i32; 3]> = serde_json::from_value(listed["voxels"].clone()).unwrap();
    voxels.sort_unstable();
    let is_near = |[x, y, z]: [i32; 3]| {
        let away = [x, y, z].map(|i| (f64::from(i) + 0.5) * 0.1);
        let from = |center: [f64; 3]| (0..3).map(|i| (away[i] - center[i]).powi(2)).sum::<f64>().sqrt();
        (y == 0 && z == 0 && (0..10).contains(&x))
            || from([0.05; 3]) <= 0.11
            || from([5.0, 0.05, 0.05]) <= 0.16
    };
    let around = (-5..60).flat_map(|x| (-5..5).flat_map(move |y| (-5..5).map(move |z| [x, y, z])));
    assert_eq!(voxels, around.filter(|&index| is_near(index)).collect::<Vec<_>>());
    let region = Some(Region::cuboid([0.0, 0.0, 0.0], [0.5, 1.0, 1.0]).unwrap());
    let query = ListingRequest { keep_out: true, ..ListingRequest::of(0, region) };
    let part = client.list_voxels(&map("a"), query).await.unwrap().keys;
    assert_eq!(part.len(), 5 + 2, "{part:?}");
    // Counted, each of them once.
    for (query, count) in
        [(query, part.len()), (ListingRequest { keep_out: true, ..Default::default() }, voxels.len())]
    {
        let counted =
            client.list_voxels(&map("a"), ListingRequest { count_only: true, ..query }).await.unwrap();
        assert_eq!((counted.voxels_total, counted.keys.len()), (count, 0));
    }
}

#[tokio::test]
async fn a_listing_of_more_than_may_be_listed_is_refused_and_one_of_a_part_is_not() {
    let daemon = Daemon::start_with(|config| config.limits.listed_voxels_max = 1000).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    let client = client_of(&daemon).await;
    let cube = |side: f64| KeepOutShape::of_region(Region::cuboid([0.0; 3], [side; 3]).unwrap()).unwrap();
    let query = ListingRequest { keep_out: true, ..ListingRequest::default() };
    client.put_keep_out(&map("a"), put("cube", cube(1.0))).await.unwrap();
    assert_eq!(client.list_voxels(&map("a"), query).await.unwrap().keys.len(), 1000);
    client.put_keep_out(&map("a"), put("cube", cube(1e12))).await.unwrap();
    let refused = json_of(daemon.get("/v1/maps/a/voxels?keep_out=true").await).await;
    assert_eq!(refused["reason"], "listing_too_large", "{refused}");
    assert!(refused["detail"].as_str().unwrap().contains("listed_voxels_max, which is 1000"), "{refused}");
    let region = Some(Region::cuboid([0.0; 3], [0.42; 3]).unwrap());
    let part = client
        .list_voxels(&map("a"), ListingRequest { keep_out: true, ..ListingRequest::of(0, region) })
        .await
        .unwrap();
    assert_eq!(part.keys.len(), 64);
    assert_eq!(client.list_voxels(&map("a"), ListingRequest::default()).await.unwrap().keys.len(), 10);
}

#[tokio::test]
async fn the_same_request_is_done_once_also_across_a_restart() {
    let daemon = started().await;
    let sphere =
        |radius: f64| json!({"sphere": {"center_m": [0, 0, 0], "radius_m": radius}, "request_id": "k-1"});
    let route = format!("{ROUTE}/dock");
    let first = json_of(daemon.put(&route, sphere(1.0)).await).await;
    daemon.put_in("a", &row(12)).await;
    let again = json_of(daemon.put(&route, sphere(1.0)).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&first["revision"], &json!(true)));
    let gone = json_of(daemon.delete(&format!("{route}?request_id=k-2")).await).await;
    assert_eq!(gone["revision"], 4);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let again = json_of(daemon.put(&route, sphere(1.0)).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&json!(2), &json!(true)));
    let again = json_of(daemon.delete(&format!("{route}?request_id=k-2")).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&json!(4), &json!(true)));
    for refused in
        [daemon.put(&route, sphere(2.0)).await, daemon.delete(&format!("{route}?request_id=k-1")).await]
    {
        assert_eq!(refused.status(), StatusCode::CONFLICT);
        assert_eq!(json_of(refused).await["reason"], "request_id_taken");
    }
    // A deletion of voxels may have the same id.
    let deletion = json!({"points": row(1), "request_id": "k-1"});
    assert_eq!(json_of(daemon.post("/v1/maps/a/deletions", deletion).await).await["removed"], 1);
    assert!(names(&daemon).await.is_empty());
}

#[tokio::test]
async fn a_keep_out_survives_a_restart_and_goes_with_its_map_file() {
    let daemon = started().await;
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    daemon.put(&format!("{ROUTE}/dock"), sphere).await;
    let before = listed(&daemon).await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(listed(&daemon).await, before);
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    let client = client_of(&daemon).await;
    client.restore_map(&map("b"), file).await.unwrap();
    let restored = client.list_keep_outs(&map("b")).await.unwrap();
    assert_eq!(restored.keep_outs, client.list_keep_outs(&map("a")).await.unwrap().keep_outs);
}

#[tokio::test]
async fn a_keep_out_is_no_change_that_undo_takes_back_and_undo_of_others_leaves_it() {
    let daemon = started().await;
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    daemon.put(&format!("{ROUTE}/dock"), sphere).await;
    daemon.post("/v1/maps/a/deletions", json!({"points": row(3)})).await;
    let undo = async |revision: u64| daemon.post("/v1/maps/a/undo", json!({"revision": revision})).await;
    let refused = undo(2).await;
    assert_eq!(refused.status(), StatusCode::PRECONDITION_FAILED);
    let refused = json_of(refused).await;
    assert_eq!(refused["reason"], "not_undoable");
    assert!(
        refused["detail"].as_str().unwrap().contains("revision 2 of map a put or ended a keep-out"),
        "{refused}"
    );
    assert_eq!(json_of(undo(3).await).await["restored"], 3);
    assert_eq!(json_of(undo(1).await).await["removed"], 10);
    assert_eq!((names(&daemon).await, daemon.contents("a").await.1.len()), (vec!["dock".to_owned()], 0));
}

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

#[tokio::test]
async fn a_keep_out_ends_when_its_time_is_up_by_a_revision_of_its_own() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let watched = WatchRequest::default();
    let mut told = client.watch(&map("a"), watched).await.unwrap();
    let soon =
        PutKeepOut { expires_at_ns: Some(now_ns() + 300_000_000), ..put("spill", ball([0.0; 3], 1.0)) };
    client.put_keep_out(&map("a"), soon).await.unwrap();
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let ended = async {
        loop {
            let message = told.next().await.unwrap().unwrap();
            if let WatchEvent::Change(part) = message.event
                && part.revision == 4
            {
                return part;
            }
        }
    };
    let ended = tokio::time::timeout(PATIENCE, ended).await.unwrap();
    let expired = KeepOutChange { name: name("spill"), act: KeepOutAct::Expired };
    assert_eq!((ended.cause, ended.removed.len()), (Cause::KeepOut(expired), 0));
    assert_eq!(names(&daemon).await, ["dock"]);
    // Nothing else is due.
    assert_eq!(daemon.contents("a").await.0, 4);
}

#[tokio::test]
async fn a_keep_out_whose_time_was_up_while_the_server_was_down_ends_at_its_start() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let at = now_ns() + 400_000_000;
    let soon = PutKeepOut { expires_at_ns: Some(at), ..put("spill", ball([0.0; 3], 1.0)) };
    client.put_keep_out(&map("a"), soon).await.unwrap();
    drop(client);
    let data = daemon.stop().await;
    while now_ns() < at {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let daemon = Daemon::start_in(data, |_| {}).await;
    let query = json!({"points": row(1), "min_revision": 3});
    let answer = json_of(daemon.post("/v1/maps/a/occupancy", query).await).await;
    assert_eq!(answer["revision"], 3, "{answer}");
    assert!(names(&daemon).await.is_empty());
}

#[tokio::test]
async fn who_watches_is_told_of_keep_outs_in_both_forms_and_from_the_journal() {
    let daemon = Daemon::start_with(|config| config.store.watch_bytes_max = 1).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let removal = DeleteKeepOut { name: name("dock"), request_id: None };
    client.put_keep_out(&map("a"), put("spill", ball([1.0; 3], 2.0))).await.unwrap();
    client.delete_keep_out(&map("a"), removal).await.unwrap();
    let map_uuid = client.map_info(&map("a")).await.unwrap().version.map_uuid;
    // The ring has room for none of them: what came since is read from the journal.
    let since = Some(WatchedSince { revision: 1, map_uuid });
    let mut told = client.watch(&map("a"), WatchRequest { since, ..WatchRequest::default() }).await.unwrap();
    let mut causes = Vec::new();
    while causes.len() < 3 {
        if let WatchEvent::Change(part) = told.next().await.unwrap().unwrap().event {
            assert!(part.is_last && part.removed.is_empty() && part.added.is_empty());
            causes.push(part.cause);
        }
    }
    let of = |text: &str, act| Cause::KeepOut(KeepOutChange { name: name(text), act });
    let made = |shape| KeepOutAct::Put { shape, made_by: None, expires_at_ns: None };
    let expected = [
        of("dock", made(ball([0.0; 3], 1.0))),
        of("spill", made(ball([1.0; 3], 2.0))),
        of("dock", KeepOutAct::Removed { by: None }),
    ];
    assert_eq!(causes, expected);
    // The whole state has them, in its first part.
    for form in [WatchForm::Changes, WatchForm::Deltas { level: 1 }] {
        let mut told =
            client.watch(&map("a"), WatchRequest { form, ..WatchRequest::default() }).await.unwrap();
        let WatchEvent::State(state) = told.next().await.unwrap().unwrap().event else { panic!("no state") };
        assert_eq!(state.keep_outs, client.list_keep_outs(&map("a")).await.unwrap().keep_outs);
    }
}

#[tokio::test]
async fn who_watches_deltas_is_told_of_keep_outs_as_they_come() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let region = Some(Region::ball([9.0; 3], 0.1).unwrap());
    let request = WatchRequest { form: WatchForm::Deltas { level: 2 }, region, ..WatchRequest::default() };
    let mut told = client.watch(&map("a"), request).await.unwrap();
    told.next().await.unwrap().unwrap();
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let WatchEvent::Change(part) = told.next().await.unwrap().unwrap().event else { panic!("no change") };
    assert!(part.revision == 2 && matches!(part.cause, Cause::KeepOut(_)) && part.content_hash.is_some());
}

#[tokio::test]
async fn a_replica_follows_keep_outs_and_regards_them_as_the_server_does() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("dock", ball([3.0, 0.0, 0.0], 0.5))).await.unwrap();
    let replica = Replica::open(client.clone(), map("a"), ReplicaOptions::default()).await.unwrap();
    let points: Vec<_> = (-70..70).map(|i| [i as f32 * 0.1 + 0.05, 0.05, 0.05].into()).collect();
    let agree = async |revision: u64| {
        replica.wait_for_revision(revision, PATIENCE).await.unwrap();
        for keep_out in [false, true] {
            let query = PointQuery {
                points: points.clone().into(),
                map_from_points: None,
                level: 0,
                lookup: Lookup::Exact,
                min_revision: Some(revision),
                map_uuid: None,
                keep_out,
            };
            let own = replica.query_points(&query).unwrap();
            assert_eq!(own, client.query_points(&map("a"), query).await.unwrap());
        }
        let of_server = client.list_keep_outs(&map("a")).await.unwrap().keep_outs;
        assert!(replica.map().keep_outs().iter().eq(&of_server));
    };
    agree(2).await;
    client.put_keep_out(&map("a"), put("spill", ball([-3.0, 0.0, 0.0], 1.5))).await.unwrap();
    agree(3).await;
    daemon.put_in("a", &row(30)).await;
    client.put_keep_out(&map("a"), put("dock", ball([6.0, 0.0, 0.0], 0.5))).await.unwrap();
    agree(5).await;
    let removal = DeleteKeepOut { name: name("spill"), request_id: None };
    client.delete_keep_out(&map("a"), removal).await.unwrap();
    agree(6).await;
    assert_eq!(replica.status().resets, 1);
}
