//! A key for some robots sends and undoes the scans of no others.

use mrol::access::{Operation, Scope, Secret};
use mrol::wire::pb;
use prost::Message;
use reqwest::Method;
use serde_json::{Value, json};

use super::asking::first_answer;
use super::keyring::{Guarded, Keyring};
use crate::support::daemon::{guess_pb, identity_json, points_pb, scan_pb};

const POINTS: [[f32; 3]; 1] = [[1.0, 2.0, 3.0]];

fn robots_key(keys: &Keyring, name: &str, scope: Scope) -> Secret {
    let secret = keys.add(name, scope, None);
    keys.set(name, "robots = [\"r1\"]");
    secret
}

/// The reason of the refusal of a call; none where it got past the rules.
async fn grpc(server: &Guarded, operation: Operation, message: Vec<u8>, key: &Secret) -> Option<String> {
    let call = operation.grpc().unwrap();
    let answer = first_answer(server.daemon.channel().await, call, message, Some(key)).await;
    let status = answer.err().filter(|status| status.code() == tonic::Code::PermissionDenied)?;
    Some(status.metadata().get("mrol-reason").unwrap().to_str().unwrap().to_owned())
}

async fn http(server: &Guarded, path: &str, body: Value, key: &Secret) -> Option<String> {
    let path = format!("/v1/maps/own/{path}");
    let answer = server.http(Method::POST, &path, Some(key), Some(body)).await;
    let refused = answer.status() == reqwest::StatusCode::FORBIDDEN;
    let error: Value = answer.json().await.unwrap();
    refused.then(|| error["reason"].as_str().unwrap().to_owned())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_acts_as_its_own_robots_alone() {
    let (server, keys) = Guarded::start_with(|keys| {
        [Scope::Insert, Scope::Write, Scope::Admin]
            .map(|scope| robots_key(keys, &format!("k-{scope}"), scope))
    })
    .await;
    server.make_map("own").await;
    for key in &keys {
        for (robot, expected) in [("r1", None), ("r2", Some("robot_not_allowed"))] {
            let scan = scan_pb("own", robot, &POINTS).encode_to_vec();
            for operation in [Operation::InsertScan, Operation::InsertScanStream] {
                assert_eq!(
                    grpc(&server, operation, scan.clone(), key).await.as_deref(),
                    expected,
                    "{operation:?}"
                );
            }
            let scan =
                Some(pb::Scan { robot: robot.into(), points: points_pb(&POINTS), ..Default::default() });
            let align = pb::AlignScanRequest {
                map: "own".into(),
                scan,
                guess: guess_pb([0.0; 3]),
                ..Default::default()
            };
            assert_eq!(
                grpc(&server, Operation::AlignScan, align.encode_to_vec(), key).await.as_deref(),
                expected
            );
            let scan = json!({"robot": robot, "points": POINTS, "guess": identity_json(), "align": false});
            for path in ["scans", "alignment"] {
                assert_eq!(http(&server, path, scan.clone(), key).await.as_deref(), expected, "{path}");
            }
            for undo in [json!({"robot": robot, "scan_id": 1}), json!({"robot": robot, "since_revision": 0})]
            {
                assert_eq!(http(&server, "undo", undo.clone(), key).await.as_deref(), expected, "{undo}");
            }
        }
        let revision = http(&server, "undo", json!({"revision": 1}), key).await;
        assert_eq!(revision.as_deref(), Some("robot_not_allowed"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn scope_insert_undoes_scans_of_named_robots_and_deletes_nothing() {
    let (server, key) = Guarded::start_with(|keys| keys.add("robots", Scope::Insert, None)).await;
    server.make_map("own").await;
    assert_eq!(http(&server, "undo", json!({"robot": "r9", "scan_id": 1}), &key).await, None);
    for (path, body) in [("undo", json!({"revision": 1})), ("deletions", json!({"points": POINTS}))] {
        assert_eq!(http(&server, path, body, &key).await.as_deref(), Some("scope_too_small"), "{path}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_may_only_insert_is_not_told_the_names_of_other_robots() {
    let (server, [inserting, writing]) = Guarded::start_with(|keys| {
        [("robots", Scope::Insert), ("tools", Scope::Write)].map(|(name, scope)| keys.add(name, scope, None))
    })
    .await;
    server.make_map("own").await;
    let scan = json!({"robot": "hidden", "points": POINTS, "guess": identity_json(), "align": false});
    assert_eq!(http(&server, "scans", scan, &writing).await, None);
    for (key, is_named) in [(&inserting, false), (&writing, true)] {
        let undo = json!({"robot": "r9", "since_revision": 0});
        let answer = server.http(Method::POST, "/v1/maps/own/undo", Some(key), Some(undo)).await;
        let error: Value = answer.json().await.unwrap();
        assert_eq!(error["reason"], "robot_not_found", "{error}");
        assert_eq!(error.to_string().contains("hidden"), is_named, "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn scope_insert_carves_nothing_because_a_scan_says_so() {
    let (server, [inserting, writing]) = Guarded::start_with(|keys| {
        [("robots", Scope::Insert), ("tools", Scope::Write)]
            .map(|(name, scope)| robots_key(keys, name, scope))
    })
    .await;
    server.make_map("own").await;
    let scan = |carve: Option<bool>, align: bool| {
        let scan = json!({"robot": "r1", "points": POINTS, "guess": identity_json(), "align": align});
        let mut scan = scan.as_object().unwrap().clone();
        scan.extend(carve.map(|carve| ("carve".to_owned(), carve.into())));
        Value::from(scan)
    };
    for align in [false, true] {
        for (carve, key, expected) in [
            (Some(true), &inserting, Some("scope_too_small")),
            (Some(false), &inserting, None),
            (None, &inserting, None),
            (Some(true), &writing, None),
        ] {
            let told = http(&server, "scans", scan(carve, align), key).await;
            assert_eq!(told.as_deref(), expected, "carve {carve:?}, align {align}");
        }
    }
    let message = pb::InsertScanRequest { carve: Some(true), ..scan_pb("own", "r1", &POINTS) };
    for operation in [Operation::InsertScan, Operation::InsertScanStream] {
        let told = grpc(&server, operation, message.encode_to_vec(), &inserting).await;
        assert_eq!(told.as_deref(), Some("scope_too_small"), "{operation:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_keys_request_ids_are_not_anothers() {
    let (server, [mallory, alice]) =
        Guarded::start_with(|keys| ["mallory", "alice"].map(|name| keys.add(name, Scope::Write, None))).await;
    server.make_map("own").await;
    let ask = async |path: &str, body: Value, key: &Secret| {
        let path = format!("/v1/maps/own/{path}");
        server.http(Method::POST, &path, Some(key), Some(body)).await.json::<Value>().await.unwrap()
    };
    let scan =
        json!({"robot": "r", "points": [[1, 2, 3], [4, 5, 6]], "guess": identity_json(), "align": false});
    ask("scans", scan, &alice).await;
    let delete = |point: [i32; 3]| json!({"points": [point], "request_id": "job-1"});
    let first = ask("deletions", delete([1, 2, 3]), &mallory).await;
    assert_eq!((&first["removed"], &first["replayed"]), (&json!(1), &json!(false)));
    // The same id with other content, and nothing is told of the other's.
    let second = ask("deletions", delete([4, 5, 6]), &alice).await;
    assert_eq!((&second["removed"], &second["replayed"]), (&json!(1), &json!(false)), "{second}");
    for (key, point, done) in [(&mallory, [1, 2, 3], first), (&alice, [4, 5, 6], second)] {
        let again = ask("deletions", delete(point), key).await;
        assert_eq!((&again["replayed"], &again["revision"]), (&json!(true), &done["revision"]));
    }
}
