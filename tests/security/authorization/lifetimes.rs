//! Keys end, are rotated and revoked; what was begun with them ends as well.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

use mrol::access::{Expiry, Scope, Secret};
use mrol::wire::pb;
use reqwest::{Method, StatusCode};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpSocket;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Request};

use super::keyring::{Guarded, Keyring};
use crate::support::daemon::{PATIENCE, query_pb, scan_pb};
use crate::support::process::Process;
use crate::support::skipped::skipped_in_part;

fn key(arguments: &[&str], file: &std::path::Path) -> (bool, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    let output = command.arg("key").args(arguments).arg("--file").arg(file).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().trim().to_owned();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

async fn until(server: &Guarded, key: &Secret, status: StatusCode) -> Value {
    let start = Instant::now();
    loop {
        let answer = server.http(Method::GET, "/v1/maps", Some(key), None).await;
        if answer.status() == status {
            return answer.json().await.unwrap();
        }
        assert!(start.elapsed() < PATIENCE, "it is never answered with {status}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

fn with_key<T>(message: T, key: &Secret) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
    request
}

#[test]
fn keys_that_are_made_at_once_are_all_in_the_file() {
    let keyring = Keyring::empty();
    let making: Vec<_> = (0..12)
        .map(|i| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
            command.args(["key", "new", "--scope", "read", "--name", &format!("k{i}"), "--file"]);
            command.arg(keyring.file()).stdout(std::process::Stdio::null()).spawn().unwrap()
        })
        .collect();
    let made =
        making.into_iter().filter_map(|mut child| child.wait().unwrap().success().then_some(())).count();
    let (_, listed, _) = key(&["list"], &keyring.file());
    let names: BTreeSet<_> = listed.lines().map(|line| line.split(':').next().unwrap()).collect();
    assert_eq!((made, names.len()), (12, 12), "{listed}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_is_refused_from_its_end_on_and_its_stream_ends() {
    let (server, [past, near]) = Guarded::start_with(|keys| {
        let past = keys.add("past", Scope::Read, None);
        keys.set("past", "expires = 2020-01-31");
        let near = keys.add("near", Scope::Read, None);
        let end = Expiry::after(SystemTime::now(), Duration::from_secs(8)).unwrap();
        keys.set("near", &format!("expires = {end}"));
        [past, near]
    })
    .await;
    server.make_map("own").await;
    let (send, requests) = tokio::sync::mpsc::channel(1);
    send.send(query_pb("own", &[[1.0, 2.0, 3.0]])).await.unwrap();
    let stream = with_key(ReceiverStream::new(requests), &near);
    let mut answers = server.daemon.occupancy().await.query_points_stream(stream).await.unwrap().into_inner();
    assert!(answers.message().await.unwrap().is_some());

    let refused = until(&server, &past, StatusCode::UNAUTHORIZED).await;
    assert_eq!(refused["reason"], "key_expired");
    assert!(refused["detail"].as_str().unwrap().contains("2020-01-31T00:00:00Z"));
    let ended = tokio::time::timeout(PATIENCE, answers.message()).await.unwrap().unwrap_err();
    assert_eq!(ended.code(), Code::Unauthenticated);
    assert_eq!(ended.metadata().get("mrol-reason").unwrap(), "key_expired");
    assert_eq!(until(&server, &near, StatusCode::UNAUTHORIZED).await["reason"], "key_expired");
}

#[tokio::test(flavor = "multi_thread")]
async fn during_a_rotation_both_secrets_count_and_a_revoked_key_none() {
    let (server, first) = Guarded::start_with(|keys| keys.add("robot", Scope::Read, None)).await;
    let file = server.keyring.file();
    fs::write(&file, format!("# ours\n{}", fs::read_to_string(&file).unwrap())).unwrap();
    let (ok, second, said) = key(&["rotate", "--name", "robot"], &file);
    assert!(ok, "{said}");
    let second = Secret::new(second);
    until(&server, &second, StatusCode::OK).await;
    until(&server, &first, StatusCode::OK).await;
    let (ok, _, said) = key(&["rotate", "--name", "robot"], &file);
    assert!(!ok && said.contains("is being rotated") && said.contains("--end-former"), "{said}");
    let (_, listed, _) = key(&["list"], &file);
    assert!(listed.contains("robot: read, every map, every robot, former secret until 20"), "{listed}");

    let (ok, third, said) = key(&["rotate", "--name", "robot", "--end-former"], &file);
    assert!(ok, "{said}");
    let third = Secret::new(third);
    until(&server, &third, StatusCode::OK).await;
    for former in [&first, &second] {
        assert_eq!(until(&server, former, StatusCode::UNAUTHORIZED).await["reason"], "key_unknown");
    }
    assert!(key(&["revoke", "--name", "robot"], &file).0);
    until(&server, &third, StatusCode::UNAUTHORIZED).await;
    let (ok, _, said) = key(&["revoke", "--name", "robot"], &file);
    assert!(!ok && said.contains("there is no key robot"), "{said}");
    assert!(!key(&["revoke", "--name", "master"], &file).0, "the last one stays");
    assert!(fs::read_to_string(&file).unwrap().starts_with("# ours\n"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_waits_ends_with_its_key_in_both_protocols() {
    let (server, key) = Guarded::start_with(|keys| keys.add("waiting", Scope::Read, None)).await;
    server.make_map("own").await;
    let wait = pb::QueryPointsRequest { min_revision: Some(1000), ..query_pb("own", &[[1.0, 2.0, 3.0]]) };
    let mut planner = server.daemon.occupancy().await;
    let wait = with_key(wait, &key);
    let call = tokio::spawn(async move { planner.query_points(wait).await });
    tokio::task::yield_now().await;
    let path = "/v1/maps/own/occupancy";
    let body = serde_json::json!({"points": [[1, 2, 3]], "min_revision": 1000});
    let url = server.daemon.url(path);
    let request = crate::support::daemon::client().post(url).bearer_auth(key.reveal()).json(&body);
    let request = tokio::spawn(async move { request.send().await.unwrap().text().await.unwrap() });
    // Both are waiting when the metrics say that they are in work.
    let start = Instant::now();
    loop {
        let metrics =
            server.http(Method::GET, "/metrics", Some(&server.master), None).await.text().await.unwrap();
        if metrics.contains("mrol_requests_in_flight{state=\"in_work\"} 2") {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "they never begin:\n{metrics}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(super::lifetimes::key(&["revoke", "--name", "waiting"], &server.keyring.file()).0);
    let ended = tokio::time::timeout(PATIENCE, call).await.unwrap().unwrap().unwrap_err();
    assert_eq!(
        (ended.code(), ended.metadata().get("mrol-reason").unwrap().to_str().unwrap()),
        (Code::Unauthenticated, "key_withdrawn")
    );
    let said = tokio::time::timeout(PATIENCE, request).await.unwrap().unwrap();
    assert!(said.contains("key_withdrawn"), "{said}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_has_bounds_of_its_own() {
    let (server, slow) = Guarded::start_with(|keys| {
        let slow = keys.add("slow", Scope::Read, None);
        keys.set("slow", "requests_per_s_max = 1\nburst_max = 2");
        slow
    })
    .await;
    let mut statuses = Vec::new();
    for _ in 0..3 {
        statuses.push(server.http(Method::GET, "/v1/maps", Some(&slow), None).await.status().as_u16());
    }
    assert!(statuses.contains(&429) && statuses[0] == 200, "{statuses:?}");
    for _ in 0..10 {
        assert_eq!(
            server.http(Method::GET, "/v1/maps", Some(&server.master), None).await.status(),
            StatusCode::OK
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_listing_under_way_ends_with_its_key_in_both_protocols() {
    // More text than the system takes of a connection that nobody reads.
    const SIDE: usize = 1000;
    let (server, key) = Guarded::start_with(|keys| keys.add("reader", Scope::Read, None)).await;
    server.make_map("own").await;
    let at = |i: usize| i as f32 * 0.1 + 0.05;
    let floor: Vec<_> = (0..SIDE * SIDE).map(|i| [at(i % SIDE), at(i / SIDE), 0.05]).collect();
    let scan = with_key(scan_pb("own", "r1", &floor), &server.master);
    server.daemon.mapping().await.insert_scan(scan).await.unwrap();

    let list = pb::ListVoxelsRequest { map: "own".into(), ..Default::default() };
    let mut planner = server.daemon.occupancy().await;
    let mut pieces = planner.list_voxels(with_key(list, &key)).await.unwrap().into_inner();
    assert!(pieces.message().await.unwrap().is_some());
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(16 << 10).unwrap();
    let mut unread = socket.connect(server.daemon.http).await.unwrap();
    let get = format!(
        "GET /v1/maps/own/voxels HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {}\r\n\r\n",
        key.reveal()
    );
    unread.write_all(get.as_bytes()).await.unwrap();
    let mut text = vec![0; 64];
    unread.read_exact(&mut text).await.unwrap();
    assert!(text.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&text));

    assert!(self::key(&["revoke", "--name", "reader"], &server.keyring.file()).0);
    until(&server, &key, StatusCode::UNAUTHORIZED).await;
    let ended = tokio::time::timeout(PATIENCE, async {
        loop {
            match pieces.message().await {
                Ok(Some(_)) => {}
                ended => break ended.map(drop),
            }
        }
    });
    let ended = ended.await.unwrap().expect_err("the listing came to its end");
    assert_eq!(ended.code(), Code::Unauthenticated);
    assert_eq!(ended.metadata().get("mrol-reason").unwrap(), "key_withdrawn");
    // HTTP has no word for it: the text breaks off.
    let cut = tokio::time::timeout(PATIENCE, unread.read_to_end(&mut text)).await;
    assert!(cut.is_ok(), "the connection stays");
    assert!(!text.ends_with(b"0\r\n\r\n"), "all {} bytes came", text.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_expires_soon_is_warned_of() {
    let (folder, keyring) = (tempfile::tempdir().unwrap(), Keyring::empty());
    for (name, days) in [("near", 3), ("far", 30)] {
        keyring.add(name, Scope::Read, None);
        let end = Expiry::after(SystemTime::now(), Duration::from_secs(days * 24 * 3600)).unwrap();
        keyring.set(name, &format!("expires = {end}"));
    }
    let (file, log) = (keyring.file(), folder.path().join("log"));
    let to = fs::File::create(&log).unwrap().into();
    let server = Process::start_with_log("", &["--keys-file", file.to_str().unwrap()], "warn", to);
    let (start, said) = (Instant::now(), || fs::read_to_string(&log).unwrap());
    let warnings = || said().lines().filter(|line| line.contains("a key expires")).count();
    while warnings() == 0 {
        assert!(start.elapsed() < PATIENCE, "nobody is warned:\n{}", said());
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!(server.stop(), Some(0));
    assert!(warnings() == 1 && said().contains("near") && !said().contains("far"), "{}", said());
}

/// Keys may be changed by the administrator; the server reads them as before.
#[test]
fn a_file_of_keys_keeps_its_owner_and_its_mode() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
    use std::os::unix::process::CommandExt;

    const OWNER: u32 = 12_345;
    const OTHER: u32 = 12_346;
    let keyring = Keyring::empty();
    let (file, folder) = (keyring.file(), keyring.file().parent().unwrap().to_owned());
    for name in ["a", "b", "c"] {
        keyring.add(name, Scope::Read, None);
    }
    let mode = |path: &std::path::Path, mode| {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    };
    let facts = || fs::metadata(&file).map(|it| (it.uid(), it.gid(), it.mode() & 0o777)).unwrap();
    mode(&file, 0o640);
    let may_give_away = chown(&file, Some(OWNER), Some(OWNER)).is_ok();
    let before = facts();
    for arguments in [&["revoke", "--name", "a"][..], &["rotate", "--name", "b"]] {
        let (ok, _, said) = key(arguments, &file);
        assert!(ok, "{said}");
        assert_eq!(facts(), before, "{arguments:?}");
    }
    if !may_give_away {
        skipped_in_part("only root gives files away");
        return;
    }
    // Somebody who may write there, and may not give a file away, changes nothing.
    mode(&file, 0o644);
    mode(&folder, 0o777);
    fs::remove_file(folder.join("keys.toml.lock")).unwrap();
    let (before, text) = (facts(), fs::read(&file).unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    command.args(["key", "revoke", "--name", "b", "--file"]).arg(&file).uid(OTHER).gid(OTHER);
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            skipped_in_part(format!("another user cannot run the program: {error}"));
            return;
        }
    };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("nothing was changed"), "{said}");
    assert_eq!((facts(), fs::read(&file).unwrap()), (before, text));
}
