//! The audit: who changed which map, from where, and which keys were refused.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use mrol::access::{Operation, Scope, Secret};
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tempfile::TempDir;
use tonic::transport::Channel;

use super::asking::first_answer;
use super::keyring::Keyring;
use super::requests::message;
use crate::support::daemon::client;
use crate::support::process::Process;

/// A server that writes JSON into a log, of which `level` lets next to nothing through.
struct Audited {
    server: Process,
    log: PathBuf,
    operator: Secret,
    _folder: TempDir,
    _keyring: Keyring,
}

impl Audited {
    fn start(options: &[&str]) -> Self {
        let (folder, keyring) = (tempfile::tempdir().unwrap(), Keyring::empty());
        let operator = keyring.add("operator", Scope::Admin, None);
        let (file, log) = (keyring.file(), folder.path().join("log"));
        let options = [&["--keys-file", file.to_str().unwrap(), "--log-format", "json"], options].concat();
        // Undo takes a journal.
        let data = folder.path().join("data");
        let log_file = File::create(&log).unwrap().into();
        let server = Process::start_with_log(data.to_str().unwrap(), &options, "off", log_file);
        Self { server, log, operator, _folder: folder, _keyring: keyring }
    }

    async fn http(
        &self,
        method: Method,
        path: &str,
        id: &str,
        key: Option<&Secret>,
        body: Value,
    ) -> Response {
        let request = client().request(method, format!("{}{path}", self.server.http));
        let request = request.header("x-request-id", id).json(&body);
        let request = key.into_iter().fold(request, |request, key| request.bearer_auth(key.reveal()));
        request.send().await.unwrap()
    }

    async fn make_map_a(&self) {
        let settings = json!({"resolution_m": 0.1, "levels": 3});
        let made = self.http(Method::PUT, "/v1/maps/a", "made", Some(&self.operator), settings).await;
        assert_eq!(made.status(), StatusCode::CREATED);
    }

    /// Ends the server; the lines of its audit.
    fn ended(self) -> Vec<Value> {
        assert_eq!(self.server.stop(), Some(0));
        audit(&self.log)
    }
}

fn audit(log: &Path) -> Vec<Value> {
    let text = fs::read_to_string(log).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).expect("a JSON object"));
    lines.filter(|line| line["target"] == "mrol::audit").collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_is_written_with_who_asked_for_it_and_what_it_did() {
    let audited = Audited::start(&[]);
    let key = Some(&audited.operator);
    let settings = json!({"resolution_m": 0.1, "levels": 3});
    let map = "/v1/maps/a";
    assert_eq!(
        audited.http(Method::PUT, map, "made", key, settings.clone()).await.status(),
        StatusCode::CREATED
    );
    // Again: nothing is changed, and a reader changes nothing anyway.
    assert_eq!(audited.http(Method::PUT, map, "made-again", key, settings).await.status(), StatusCode::OK);
    assert_eq!(audited.http(Method::GET, map, "read", key, Value::Null).await.status(), StatusCode::OK);
    let scan = json!({
        "robot": "r1", "points": [[1.0, 2.0, 0.5], [3.0, 2.0, 0.5]], "align": false,
        "guess": {"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]},
    });
    let inserted = audited.http(Method::POST, "/v1/maps/a/scans", "scan", key, scan).await;
    assert_eq!(inserted.status(), StatusCode::OK, "{}", inserted.text().await.unwrap());
    let deletion = json!({"points": [[1.0, 2.0, 0.5]]});
    let deleted = audited.http(Method::POST, "/v1/maps/a/deletions", "deleted", key, deletion).await;
    assert_eq!(deleted.status(), StatusCode::OK, "{}", deleted.text().await.unwrap());
    let undo = json!({"robot": "r1", "since_revision": 0});
    let undone = audited.http(Method::POST, "/v1/maps/a/undo", "undone", key, undo).await;
    assert_eq!(undone.status(), StatusCode::OK, "{}", undone.text().await.unwrap());
    let renamed = audited.http(Method::POST, "/v1/maps/a/rename", "renamed", key, json!({"to": "b"})).await;
    assert_eq!(renamed.status(), StatusCode::OK, "{}", renamed.text().await.unwrap());
    let map = "/v1/maps/b";
    assert_eq!(
        audited.http(Method::DELETE, map, "gone", key, Value::Null).await.status(),
        StatusCode::NO_CONTENT
    );
    let again = audited.http(Method::DELETE, map, "gone-already", key, Value::Null).await;
    assert_eq!(again.status(), StatusCode::NOT_FOUND);

    let lines = audited.ended();
    let fields = |line: &Value| {
        let span = &line["span"];
        assert_eq!(
            (&span["protocol"], &span["key"], &span["peer"]),
            (&"http".into(), &"operator".into(), &"127.0.0.1".into())
        );
        let names =
            ["operation", "map", "outcome", "revision_before", "revision", "voxels_removed", "scans_undone"];
        [vec![span["request_id"].clone()], names.map(|name| line[name].clone()).to_vec()].concat()
    };
    let told: Vec<_> = lines.iter().map(fields).collect();
    let expected = json!([
        ["made", "CreateMap", "a", "done", null, 0, 0, 0],
        ["made-again", "CreateMap", "a", "unchanged", 0, 0, 0, 0],
        ["deleted", "DeleteVoxels", "a", "done", 1, 2, 1, 0],
        ["undone", "Undo", "a", "done", 2, 3, 1, 1],
        ["renamed", "RenameMap", "a", "done", 3, 3, 0, 0],
        ["gone", "DeleteMap", "b", "done", 3, null, 0, 0],
        ["gone-already", "DeleteMap", "b", "failed", null, null, null, null],
    ]);
    assert_eq!(Value::from(told), expected);
    assert_eq!((&lines[4]["renamed_to"], &lines[5]["renamed_to"]), (&json!("b"), &Value::Null));
    assert_eq!(lines[6]["reason"], "map_not_found");
    let uuid = &lines[0]["uuid"];
    assert!(uuid.is_string() && lines[1..6].iter().all(|line| line["uuid"] == *uuid), "{lines:#?}");
}

/// What a sensor sees of a wall so far before it, a point every 1.5 degrees.
fn wall(x: f32) -> Vec<[f32; 3]> {
    let angles = || (-20..=20).map(|i| (i as f32 * 1.5).to_radians().tan());
    angles().flat_map(|y| angles().map(move |z| [x, x * y, x * z])).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_that_carves_is_written_with_how_much_it_took_out() {
    let audited = Audited::start(&[]);
    let key = Some(&audited.operator);
    audited.make_map_a().await;
    let scan = |robot: &str, wall_m: f32| {
        let guess = json!({"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]});
        json!({"robot": robot, "points": wall(wall_m), "align": false, "carve": true, "guess": guess})
    };
    let mut carved = Vec::new();
    for (robot, wall_m) in [("r2", 2.0), ("r1", 3.0)] {
        let inserted = audited.http(Method::POST, "/v1/maps/a/scans", robot, key, scan(robot, wall_m)).await;
        let answer: Value = inserted.json().await.unwrap();
        carved.push(answer["carved_voxels"].as_u64().unwrap());
    }
    assert!(carved[0] == 0 && carved[1] > 100, "{carved:?}");

    let lines = audited.ended();
    let told: Vec<_> = lines.iter().filter(|line| line["operation"] == "InsertScan").collect();
    assert_eq!(told.len(), 1, "{lines:#?}");
    let fields = ["robot", "map", "outcome", "voxels_removed", "revision"].map(|name| told[0][name].clone());
    assert_eq!(Value::from(fields.to_vec()), json!(["r1", "a", "done", carved[1], 2]));
    assert_eq!((&told[0]["span"]["key"], &told[0]["span"]["request_id"]), (&json!("operator"), &json!("r1")));
}

#[tokio::test(flavor = "multi_thread")]
async fn refusals_of_a_robot_are_written_when_they_begin_and_when_they_end() {
    let audited = Audited::start(&[]);
    let key = Some(&audited.operator);
    audited.make_map_a().await;
    let guess = json!({"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]});
    let mut refused = Vec::new();
    // The first makes the map; one wall leaves two directions open.
    for (id, points, align) in [
        (1, wall(2.0), false),
        (2, wall(2.0), true),
        (3, wall(2.0), true),
        (4, wall(2.0), false),
        (5, wall(2.0), true),
    ] {
        let scan = json!({"robot": "r1", "session": "s", "scan_id": id, "points": points, "align": align, "guess": guess});
        let answer = audited.http(Method::POST, "/v1/maps/a/scans", &id.to_string(), key, scan).await;
        let status = answer.status();
        let answer: Value = answer.json().await.unwrap();
        assert_eq!(status, StatusCode::OK, "{answer}");
        if answer["accepted"] == false {
            refused.push((id, answer["verdict"].clone(), answer["reason"].clone()));
        }
    }
    assert_eq!(refused.iter().map(|(id, ..)| *id).collect::<Vec<_>>(), [2, 3, 5]);

    let lines = audited.ended();
    let lines: Vec<_> = lines.iter().filter(|line| line["operation"] == "InsertScan").collect();
    let names = ["map", "robot", "session", "scan_id", "outcome", "verdict", "reason", "scans_refused"];
    let told: Vec<_> = lines.iter().map(|line| names.map(|name| line[name].clone()).to_vec()).collect();
    let [first, _, third] = &refused[..] else { unreachable!() };
    let expected = json!([
        ["a", "r1", "s", 2, "refused", first.1, first.2, null],
        ["a", "r1", "s", 4, "accepted_again", null, null, 2],
        ["a", "r1", "s", 5, "refused", third.1, third.2, null],
    ]);
    assert_eq!(json!(told), expected);
    assert!(lines[1]["seconds"].as_f64().unwrap() > 0.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_line_for_people_says_each_thing_of_its_request_once() {
    let (folder, keyring) = (tempfile::tempdir().unwrap(), Keyring::empty());
    let operator = keyring.add("operator", Scope::Admin, None);
    let (file, log) = (keyring.file(), folder.path().join("log"));
    let (data, log_file) = (folder.path().join("data"), File::create(&log).unwrap().into());
    let options = ["--keys-file", file.to_str().unwrap(), "--log-format", "text"];
    let server = Process::start_with_log(data.to_str().unwrap(), &options, "debug", log_file);
    let made = client().put(format!("{}/v1/maps/a", server.http)).bearer_auth(operator.reveal());
    assert_eq!(made.json(&json!({"resolution_m": 0.1})).send().await.unwrap().status(), StatusCode::CREATED);
    // What needs no key is written with whose it is, too.
    let alive = client().get(format!("{}/livez", server.http)).bearer_auth(operator.reveal());
    assert_eq!(alive.send().await.unwrap().status(), StatusCode::OK);
    assert_eq!(server.stop(), Some(0));
    let text = fs::read_to_string(&log).unwrap();
    let of_requests: Vec<&str> = text.lines().filter(|line| line.contains("request{")).collect();
    assert!(of_requests.len() >= 3, "{text}");
    for (line, name) in of_requests
        .iter()
        .flat_map(|line| ["key=", "protocol=", "peer=", "request_id="].map(|name| (line, name)))
    {
        assert_eq!(
            line.matches(&format!(" {name}")).count() + line.matches(&format!("{{{name}")).count(),
            1,
            "{line}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn refused_keys_are_written_and_a_flood_of_them_is_counted() {
    let audited = Audited::start(&[]);
    let unknown = Secret::random().unwrap();
    let create = json!({"resolution_m": 0.1});
    let refused = audited.http(Method::PUT, "/v1/maps/a", "http-1", Some(&unknown), create.clone()).await;
    assert_eq!(refused.status(), StatusCode::UNAUTHORIZED);
    let channel = Channel::from_shared(audited.server.grpc.clone()).unwrap().connect().await.unwrap();
    let call = Operation::DeleteMap.grpc().unwrap();
    let refused = first_answer(channel, call, message(Operation::DeleteMap, "a"), None).await;
    assert!(refused.is_err());
    let long = "x".repeat(20_000);
    audited.http(Method::PUT, "/v1/maps/a", &long, None, create.clone()).await;
    for _ in 0..99 {
        audited.http(Method::PUT, "/v1/maps/a", "flood", None, create.clone()).await;
    }
    // One of these is written, when the second of the flood is over, with the number of those that were not.
    tokio::time::sleep(std::time::Duration::from_millis(1100)).await;
    audited.http(Method::PUT, "/v1/maps/a", "after", None, create).await;

    let lines = audited.ended();
    assert!(lines.iter().all(|line| line["outcome"] == "denied"), "{lines:#?}");
    let of =
        |line: &Value| ["protocol", "operation", "request_id", "key"].map(|name| line["span"][name].clone());
    assert_eq!(of(&lines[0]), ["http".into(), "CreateMap".into(), "http-1".into(), Value::Null]);
    assert_eq!(lines[0]["reason"], "key_unknown");
    assert_eq!(of(&lines[1])[..2], ["grpc", "DeleteMap"]);
    assert_eq!(lines[1]["reason"], "key_missing");
    assert_eq!(lines[2]["span"]["request_id"], "x".repeat(64));
    assert!((3..60).contains(&lines.len()), "{} lines", lines.len());
    let unwritten: u64 = lines.iter().map(|line| line["unwritten"].as_u64().unwrap()).sum();
    assert_eq!(unwritten as usize + lines.len(), 103);
    assert_eq!(lines.last().unwrap()["span"]["request_id"], "after");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_audit_can_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("mrol.toml");
    fs::write(&config, "[log]\naudit = false\n").unwrap();
    let audited = Audited::start(&["--config", config.to_str().unwrap()]);
    let made = audited.http(
        Method::PUT,
        "/v1/maps/a",
        "made",
        Some(&audited.operator),
        json!({"resolution_m": 0.1}),
    );
    assert_eq!(made.await.status(), StatusCode::CREATED);
    assert_eq!(audited.ended(), Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn strangers_do_not_push_out_the_lines_of_known_keys_which_are_named() {
    let audited = Audited::start(&[]);
    let reader = audited._keyring.add("reader", Scope::Read, None);
    audited.server.signal("HUP");
    let create = json!({"resolution_m": 0.1});
    // The key is known once its file was read again.
    while audited.http(Method::GET, "/v1/maps", "wait", Some(&reader), Value::Null).await.status()
        != StatusCode::OK
    {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    for _ in 0..50 {
        audited.http(Method::PUT, "/v1/maps/a", "flood", None, create.clone()).await;
    }
    let denied = audited.http(Method::PUT, "/v1/maps/a", "denied", Some(&reader), create).await;
    assert_eq!(denied.status(), StatusCode::FORBIDDEN);
    let missing =
        audited.http(Method::DELETE, "/v1/maps/a", "failed", Some(&audited.operator), Value::Null).await;
    assert_eq!(missing.status(), StatusCode::NOT_FOUND);
    let nothing = audited.http(Method::DELETE, "/v1/maps/a", "", Some(&audited.operator), Value::Null).await;
    let made = nothing.headers()["x-request-id"].to_str().unwrap().to_owned();
    assert_eq!(made.len(), 36, "an id is made where the one sent cannot be read");

    let lines = audited.ended();
    let of =
        |id: &str| lines.iter().find(|line| line["span"]["request_id"] == id).cloned().unwrap_or_default();
    let denied = of("denied");
    assert_eq!((&denied["reason"], &denied["span"]["key"]), (&json!("scope_too_small"), &json!("reader")));
    let failed = of("failed");
    assert_eq!((&failed["reason"], &failed["span"]["key"]), (&json!("map_not_found"), &json!("operator")));
    assert_eq!(of(&made)["reason"], "map_not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_log_that_nobody_reads_stops_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let (unread, log) = std::io::pipe().unwrap();
    let server = Process::start_with_log(folder.path().to_str().unwrap(), &[], "debug", log.into());
    // Each is a line or more of some 200 bytes; a pipe holds 64 KiB.
    for _ in 0..2000 {
        let answer = client().get(format!("{}/v1/maps/none", server.http)).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::NOT_FOUND);
    }
    assert_eq!(client().get(format!("{}/livez", server.http)).send().await.unwrap().status(), StatusCode::OK);
    assert_eq!(server.stop(), Some(0));
    drop(unread);
}
