//! The file of keys changes under a running server.

use std::fs;
use std::time::{Duration, Instant};

use mrol::access::{Operation, Scope, Secret};
use mrol::wire::pb;
use reqwest::{Method, StatusCode};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Request};

use super::asking::{Outcome, over_grpc};
use super::keyring::{Guarded, add};
use crate::support::daemon::{PATIENCE, client, query_pb};

/// Waits until listing maps with `key` is answered with `status`. An answer that is on its way while its key is
/// withdrawn is cut off, which counts as another one.
async fn until(server: &Guarded, key: &Secret, status: StatusCode) {
    let start = Instant::now();
    let listed = || client().get(server.daemon.url("/v1/maps")).bearer_auth(key.reveal()).send();
    while !listed().await.is_ok_and(|answer| answer.status() == status) {
        assert!(start.elapsed() < PATIENCE, "it is never answered with {status}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

async fn metric(server: &Guarded, line: &str) -> bool {
    let metrics = server.http(Method::GET, "/metrics", Some(&server.master), None).await;
    metrics.text().await.unwrap().lines().any(|other| other == line)
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_come_and_go_without_a_restart() {
    let (server, first) = Guarded::start_with(|keys| keys.add("first", Scope::Read, None)).await;
    until(&server, &first, StatusCode::OK).await;
    let file = server.keyring.file();
    let without_first = fs::read_to_string(&file).unwrap().replace("first", "renamed");
    let second = server.keyring.add("second", Scope::Read, None);
    until(&server, &second, StatusCode::OK).await;
    until(&server, &first, StatusCode::OK).await;

    // The file of before the second, in which the first has another name.
    fs::write(&file, without_first).unwrap();
    until(&server, &second, StatusCode::UNAUTHORIZED).await;
    until(&server, &first, StatusCode::OK).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_broken_file_leaves_the_keys_that_were_and_shows_in_the_metrics() {
    let (server, key) = Guarded::start_with(|keys| keys.add("first", Scope::Read, None)).await;
    let file = server.keyring.file();
    let good = fs::read_to_string(&file).unwrap();
    for broken in
        ["", "[[key]]\nname = 1\n", &good.replace("read", "reed"), &good.replace("sha256", "sha255")]
    {
        fs::write(&file, broken).unwrap();
        let start = Instant::now();
        while !metric(&server, r#"mrol_file_reload_ok{file="keys"} 0"#).await {
            assert!(start.elapsed() < PATIENCE, "{broken:?} is not noticed");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        until(&server, &key, StatusCode::OK).await;
        fs::write(&file, &good).unwrap();
        while !metric(&server, r#"mrol_file_reload_ok{file="keys"} 1"#).await {
            assert!(start.elapsed() < PATIENCE, "it stays broken");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_ends_with_its_key_and_others_go_on() {
    let (server, keys) = Guarded::start_with(|keyring| {
        ["going", "staying"].map(|name| keyring.add(name, Scope::Read, Some(&["own"])))
    })
    .await;
    server.make_map("own").await;
    let mut streams = Vec::new();
    for key in &keys {
        let (send, requests) = tokio::sync::mpsc::channel(1);
        let mut request = Request::new(ReceiverStream::new(requests));
        request.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
        send.send(query_pb("own", &[[1.0, 2.0, 3.0]])).await.unwrap();
        let mut answers =
            server.daemon.occupancy().await.query_points_stream(request).await.unwrap().into_inner();
        assert_eq!(answers.message().await.unwrap().unwrap().points_occupied, 1);
        streams.push((send, answers));
    }
    let file = server.keyring.file();
    let text = fs::read_to_string(&file).unwrap();
    // Now it may only ask about another map.
    let (before, after) = text.split_once("name = \"going\"").unwrap();
    fs::write(&file, format!("{before}name = \"going\"{}", after.replacen("\"own\"", "\"else\"", 1)))
        .unwrap();

    let ended = tokio::time::timeout(PATIENCE, streams[0].1.message()).await.unwrap().unwrap_err();
    assert_eq!(ended.code(), Code::Unauthenticated);
    assert_eq!(ended.metadata().get("mrol-reason").unwrap(), "key_withdrawn");
    let (send, answers) = &mut streams[1];
    send.send(query_pb("own", &[[5.0, 2.0, 3.0]])).await.unwrap();
    assert_eq!(answers.message().await.unwrap().unwrap().points_occupied, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_message_of_a_stream_is_asked_for_its_map() {
    let (server, key) = Guarded::start_with(|keys| keys.add("own", Scope::Write, Some(&["own"]))).await;
    server.make_map("own").await;
    server.make_map("other").await;
    let messages = ["own", "own", "other", "own"].map(|map| query_pb(map, &[[1.0, 2.0, 3.0]]));
    let mut request = Request::new(tokio_stream::iter(messages));
    request.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
    let mut answers =
        server.daemon.occupancy().await.query_points_stream(request).await.unwrap().into_inner();
    for _ in 0..2 {
        let answer: pb::QueryPointsResponse = answers.message().await.unwrap().unwrap();
        assert_eq!(answer.points_occupied, 1);
    }
    let refused = answers.message().await.unwrap_err();
    assert_eq!(refused.code(), Code::PermissionDenied);
    assert_eq!(refused.metadata().get("mrol-reason").unwrap(), "map_not_allowed");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_is_given_more_may_do_more() {
    let (server, key) = Guarded::start_with(|keys| keys.add("growing", Scope::Read, None)).await;
    server.make_map("own").await;
    let (operation, channel) = (Operation::InsertScan, server.daemon.channel().await);
    let insert =
        async || over_grpc(channel.clone(), operation, operation.grpc().unwrap(), "own", Some(&key)).await;
    assert!(matches!(insert().await, Outcome::Denied { .. }));
    let file = server.keyring.file();
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("scope = \"read\"", "scope = \"write\"")).unwrap();
    let start = Instant::now();
    while insert().await != Outcome::LetIn {
        assert!(start.elapsed() < PATIENCE);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[test]
fn a_key_is_added_to_what_is_there_and_never_twice() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    add(&file, "a", Scope::Read, None);
    fs::write(&file, format!("# mine\n{}", fs::read_to_string(&file).unwrap())).unwrap();
    add(&file, "b", Scope::Admin, Some(&["x", "y"]));
    let text = fs::read_to_string(&file).unwrap();
    assert!(
        text.starts_with("# mine\n") && text.contains("maps = [\n") || text.contains("maps = [\"x\", \"y\"]"),
        "{text}"
    );
    let same_name = mrol::access::KeyName::new("a").unwrap();
    let digest = Secret::random().unwrap().digest();
    let twice = mrol::access::Key::new(same_name, digest, Scope::Read, mrol::service::AllowedMaps::Every);
    let refused = mrol::access::add_to_file(&file, &twice).unwrap_err().to_string();
    assert!(refused.contains("another key has that name"), "{refused}");
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
    use std::os::unix::fs::PermissionsExt;
    assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
}
