//! What a caller who may not see something learns of it.

use std::fs::{self, File};
use std::time::{Duration, Instant};

use mrol::access::{Operation, Scope, Secret};
use mrol::wire::pb;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use tonic::transport::Channel;

use super::asking::{Outcome, first_answer, over_grpc, over_http};
use super::keyring::{Guarded, Keyring};
use super::requests::message;
use crate::support::daemon::{Daemon, PATIENCE, client};
use crate::support::process::Process;

#[tokio::test(flavor = "multi_thread")]
async fn a_key_learns_nothing_of_maps_that_it_is_not_for() {
    let (server, key) =
        Guarded::start_with(|keys| keys.add("own", Scope::Admin, Some(&["own", "later"]))).await;
    server.make_map("own").await;
    server.make_map("other").await;

    let list: Value = server.http(Method::GET, "/v1/maps", Some(&key), None).await.json().await.unwrap();
    let names: Vec<_> = list["maps"].as_array().unwrap().iter().map(|map| &map["map"]).collect();
    assert_eq!(names, ["own"]);

    // A map that is there and one that is not are refused with the same words.
    let channel = server.daemon.channel().await;
    for operation in [Operation::GetMap, Operation::CreateMap, Operation::DeleteMap, Operation::QueryPoints] {
        let mut words = Vec::new();
        for map in ["other", "absent"] {
            let (call, route) = (operation.grpc().unwrap(), operation.route().unwrap());
            let outcomes = [
                over_grpc(channel.clone(), operation, call, map, Some(&key)).await,
                over_http(&server, operation, route, map, Some(&key)).await,
            ];
            for outcome in outcomes {
                let Outcome::Denied { message, .. } = outcome else { panic!("{operation:?}: {outcome:?}") };
                words.push(message.replace(map, "..."));
            }
        }
        assert_eq!(words, vec!["the key is not for map ...: it is for later, own"; 4], "{operation:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_renames_a_map_only_between_names_that_it_may_name() {
    let (server, key) =
        Guarded::start_with(|keys| keys.add("own", Scope::Admin, Some(&["own", "later"]))).await;
    server.make_map("own").await;
    server.make_map("other").await;
    let rename = async |map: &str, to: &str| {
        let path = format!("/v1/maps/{map}/rename");
        let answer = server.http(Method::POST, &path, Some(&key), Some(json!({ "to": to }))).await;
        (answer.status(), answer.text().await.unwrap())
    };
    // Whether or not there is a map of the name.
    for (map, to, refused) in [
        ("own", "other", "other"),
        ("own", "absent", "absent"),
        ("other", "later", "other"),
        ("absent", "own", "absent"),
    ] {
        let (status, told) = rename(map, to).await;
        assert_eq!(status, StatusCode::FORBIDDEN, "{map} to {to}: {told}");
        assert!(told.contains(&format!("the key is not for map {refused}: it is for later, own")), "{told}");
    }
    assert_eq!(server.maps().await, ["other", "own"]);
    assert_eq!(rename("own", "later").await.0, StatusCode::OK);
    assert_eq!(server.maps().await, ["later", "other"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn health_is_told_to_anybody_and_names_no_map() {
    let (server, ()) = Guarded::start_with(|_| ()).await;
    server.make_map("own").await;
    for path in ["/livez", "/readyz"] {
        let answer = server.http(Method::GET, path, None, None).await;
        assert_eq!(answer.status(), StatusCode::OK, "{path}");
        assert!(!answer.text().await.unwrap().contains("own"));
    }
    let check = message(Operation::HealthCheck, "");
    let call = Operation::HealthCheck.grpc().unwrap();
    assert!(first_answer(server.daemon.channel().await, call, check, None).await.unwrap().is_some());
    // A route that is none needs no key to be told so.
    assert_eq!(server.http(Method::GET, "/v2", None, None).await.status(), StatusCode::NOT_FOUND);
    let patch = server.http(Method::PATCH, "/v1/maps/own", None, None).await;
    assert_eq!(patch.status(), StatusCode::METHOD_NOT_ALLOWED);
    assert_eq!(patch.headers()["allow"], "PUT,GET,DELETE,HEAD");
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_count_by_key_and_are_open_where_the_settings_say_so() {
    let (server, key) = Guarded::start_with(|keys| keys.add("prometheus", Scope::Read, None)).await;
    server.make_map("own").await;
    let metrics = server.http(Method::GET, "/metrics", Some(&key), None).await.text().await.unwrap();
    for line in [
        r#"mrol_key_requests_total{protocol="http",key="prometheus"} 1"#,
        r#"mrol_file_reload_ok{file="keys"} 1"#,
    ] {
        assert!(metrics.contains(line), "{line} is not in\n{metrics}");
    }
    let file = server.keyring.file();
    let open = Daemon::start_with(|config| {
        config.access.keys_file = Some(file);
        config.access.open_metrics = true;
    });
    let open = open.await;
    assert_eq!(open.get("/metrics").await.status(), StatusCode::OK);
    assert_eq!(open.get("/v1/maps").await.status(), StatusCode::UNAUTHORIZED);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_listener_for_monitors_asks_for_the_same_keys() {
    let keyring = Keyring::empty();
    let key = keyring.add("prometheus", Scope::Read, None);
    let file = keyring.file();
    let server = Daemon::start_with(|config| {
        config.access.keys_file = Some(file);
        config.admin.listen = Some(([127, 0, 0, 1], 0).into());
    })
    .await;
    let url = |path: &str| format!("http://{}{path}", server.admin.unwrap());
    let status = async |request: reqwest::RequestBuilder| request.send().await.unwrap().status();
    assert_eq!(status(client().get(url("/livez"))).await, StatusCode::OK);
    assert_eq!(status(client().get(url("/metrics"))).await, StatusCode::UNAUTHORIZED);
    assert_eq!(status(client().get(url("/metrics")).bearer_auth(key.reveal())).await, StatusCode::OK);
    assert_eq!(status(client().get(url("/v1/maps")).bearer_auth(key.reveal())).await, StatusCode::NOT_FOUND);
}

/// The map that was there gets another name, which a key for some maps does not reach.
#[tokio::test(flavor = "multi_thread")]
async fn a_key_for_some_maps_replaces_none() {
    let (server, key) = Guarded::start_with(|keys| keys.add("own", Scope::Admin, Some(&["own"]))).await;
    server.make_map("own").await;
    let path = "/v1/maps/own/snapshot";
    let snapshot = server.http(Method::GET, path, Some(&key), None).await;
    let file = snapshot.bytes().await.unwrap();
    let replace = async |key: &Secret| {
        let put = client().put(server.daemon.url(&format!("{path}?replace=true"))).bearer_auth(key.reveal());
        put.header("content-type", "application/octet-stream").body(file.clone()).send().await.unwrap()
    };
    let refused = replace(&key).await;
    assert_eq!(refused.status(), StatusCode::FORBIDDEN);
    assert_eq!(refused.json::<Value>().await.unwrap()["reason"], "map_not_allowed");
    let piece = pb::RestoreMapRequest { map: "own".into(), data: file.clone(), replace: true };
    let mut call = tonic::Request::new(tokio_stream::iter([piece]));
    call.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
    let refused = server.daemon.maps().await.restore_map(call).await.unwrap_err();
    assert_eq!(refused.metadata().get("mrol-reason").unwrap(), "map_not_allowed");
    assert_eq!(server.maps().await, ["own"]);
    assert_eq!(replace(&server.master).await.status(), StatusCode::CREATED);
    assert_eq!(server.maps().await, ["own", "own-replaced-1"]);
}

/// The log of everything that every crate in it has to say, while keys are used, misused and misplaced.
#[tokio::test(flavor = "multi_thread")]
async fn no_secret_is_ever_in_the_log() {
    let (folder, keyring) = (tempfile::tempdir().unwrap(), Keyring::empty());
    let (known, unknown) = (keyring.add("r1", Scope::Write, None), Secret::random().unwrap());
    let (file, log) = (keyring.file(), folder.path().join("log"));
    let server = Process::start_with_log(
        "",
        &["--keys-file", file.to_str().unwrap()],
        "trace",
        File::create(&log).unwrap().into(),
    );
    let channel = Channel::from_shared(server.grpc.clone()).unwrap().connect().await.unwrap();
    for key in [&known, &unknown] {
        for path in ["/v1/maps", "/v1/maps/a", "/readyz", "/nowhere"] {
            client().get(format!("{}{path}", server.http)).bearer_auth(key.reveal()).send().await.unwrap();
        }
        let put = client().put(format!("{}/v1/maps/a", server.http)).bearer_auth(key.reveal());
        put.json(&json!({"resolution_m": 0.1})).send().await.unwrap();
        for operation in [Operation::ListMaps, Operation::InsertScan, Operation::CreateMap] {
            let (call, message) = (operation.grpc().unwrap(), message(operation, "a"));
            let _ = first_answer(channel.clone(), call, message, Some(key)).await;
        }
    }
    // A secret where none belongs, in a file that is none.
    fs::write(&file, format!("[[key]]\nname = \"{}\"\nsecret = true\n", unknown.reveal())).unwrap();
    let (start, said) = (Instant::now(), || fs::read_to_string(&log).unwrap());
    while !said().contains("keys.toml: line") {
        assert!(start.elapsed() < PATIENCE, "the file is not looked at");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    // Told to read it at once, it says the same, and lives on.
    let complaints = || said().matches("keys.toml: line").count();
    let before = complaints();
    server.signal("HUP");
    while complaints() == before {
        assert!(start.elapsed() < PATIENCE, "the signal is not heard");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!(server.stop(), Some(0));
    // It is the log of these requests, with what the crates below say of them.
    assert!(
        said().contains("h2::")
            && said().contains("operation=\"InsertScan\"")
            && said().contains("key=\"r1\"")
    );
    for secret in [known, unknown] {
        assert!(!said().contains(secret.reveal()), "a secret is in the log");
        assert!(!said().contains(&secret.digest().to_string()), "a hash is in the log");
    }
}
