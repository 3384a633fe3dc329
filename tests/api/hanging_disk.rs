//! Disks that hang at a start or at the end: the server ends all the same, and other maps are served.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use reqwest::StatusCode;
use serde_json::json;
use tokio::task::JoinSet;
use tonic::transport::Endpoint;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;

use crate::support::daemon::{PATIENCE, client, identity_json, json_of, row, wait_until};
use crate::support::map_folders::folder_of;
use crate::support::process::Process;

/// A pipe that nobody writes to or reads from: who opens it waits for ever, as on a disk that hangs.
fn make_hang(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo").success());
}

/// The exit code of a process that must end by itself.
async fn code_at_end(server: Process) -> Option<i32> {
    let ended = tokio::time::timeout(PATIENCE, tokio::task::spawn_blocking(|| server.ended())).await;
    ended.expect("its end").expect("no panic")
}

#[tokio::test(flavor = "multi_thread")]
async fn told_to_end_while_a_disk_that_hangs_is_read_it_ends() {
    let data = tempfile::tempdir().unwrap();
    fs::create_dir(data.path().join("maps")).unwrap();
    make_hang(&data.path().join("maps/attic.mrol"));
    let log = data.path().join("log");
    let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
    serve.args(["serve", "--data-dir", data.path().to_str().unwrap()]);
    serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]);
    let mut server = serve.stdout(Stdio::null()).stderr(File::create(&log).unwrap()).spawn().unwrap();
    let said = || fs::read_to_string(&log).unwrap();
    wait_until(async || said().contains("opening the maps")).await;
    let tell = Command::new("kill").args(["-s", "TERM", &server.id().to_string()]).status();
    assert!(tell.unwrap().success());
    let start = Instant::now();
    let code = loop {
        match server.try_wait().unwrap() {
            Some(status) => break status.code(),
            None if start.elapsed() > PATIENCE => {
                server.kill().unwrap();
                panic!("it opens maps still: {}", said());
            }
            None => tokio::time::sleep(Duration::from_millis(10)).await,
        }
    };
    assert_eq!(code, Some(0), "{}", said());
    assert!(said().contains("told to end while the maps are being opened"), "{}", said());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_is_served_while_the_disk_of_another_hangs_and_it_ends_in_time() {
    let data = tempfile::tempdir().unwrap();
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    for name in ["a", "b"] {
        let map = format!("{}/v1/maps/{name}", server.http);
        client().put(&map).json(&json!({"resolution_m": 0.1})).send().await.unwrap();
    }
    assert_eq!(server.stop(), Some(0));
    for file in fs::read_dir(folder_of(data.path(), "b")).unwrap().map(|file| file.unwrap().path()) {
        fs::remove_file(&file).unwrap();
        make_hang(&file);
    }

    let server = Process::start(data.path().to_str().unwrap(), &["--drain-seconds", "1"]);
    let get = async |path: &str| client().get(format!("{}{path}", server.http)).send().await.unwrap();
    assert_eq!(get("/v1/maps/a").await.status(), StatusCode::OK);
    wait_until(async || json_of(get("/readyz").await).await["maps_open"] == 1).await;
    let ready = get("/readyz").await;
    assert_eq!(ready.status(), StatusCode::SERVICE_UNAVAILABLE);
    let told = json_of(ready).await;
    assert_eq!(
        (&told["ready"], &told["reason"], &told["maps"]),
        (&json!(false), &json!("starting"), &json!(2))
    );
    let scraped = get("/metrics").await.text().await.unwrap();
    assert!(scraped.contains("map=\"a\""), "{scraped}");
    let mut health =
        HealthClient::new(Endpoint::from_shared(server.grpc.clone()).unwrap().connect().await.unwrap());
    assert_eq!(health.check(HealthCheckRequest::default()).await.unwrap().into_inner().status, 2);
    server.signal("TERM");
    code_at_end(server).await.expect("it ends by itself");
}

#[tokio::test(flavor = "multi_thread")]
async fn more_maps_whose_disks_hang_than_are_opened_at_once_keep_no_other_from_being_opened_or_made() {
    let data = tempfile::tempdir().unwrap();
    let at_once = std::thread::available_parallelism().unwrap().get().max(2);
    let hanging: Vec<String> = (0..2 * at_once).map(|k| format!("hangs-{k:03}")).collect();
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    let made = async |server: &Process, name: &str| {
        let map = format!("{}/v1/maps/{name}", server.http);
        client().put(&map).json(&json!({"resolution_m": 0.1})).send().await.unwrap().status()
    };
    for name in hanging.iter().map(String::as_str).chain(["well"]) {
        assert_eq!(made(&server, name).await, StatusCode::CREATED);
    }
    assert_eq!(server.stop(), Some(0));
    for name in &hanging {
        for file in fs::read_dir(folder_of(data.path(), name)).unwrap().map(|file| file.unwrap().path()) {
            fs::remove_file(&file).unwrap();
            make_hang(&file);
        }
    }

    let server = Process::start(data.path().to_str().unwrap(), &["--drain-seconds", "1"]);
    let of = |name: &str| format!("{}/v1/maps/{name}", server.http);
    for name in &hanging {
        // Whoever asked is gone soon.
        let asked = client().delete(of(name)).timeout(Duration::from_millis(200)).send().await;
        assert!(asked.is_err_and(|gone| gone.is_timeout()));
    }
    assert_eq!(made(&server, "new").await, StatusCode::CREATED);
    assert_eq!(client().get(of("well")).send().await.unwrap().status(), StatusCode::OK);
    let told = client().get(of(&hanging[0])).send().await.unwrap();
    assert_eq!(told.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(json_of(told).await["reason"], "catalog_busy");
    server.signal("TERM");
    code_at_end(server).await.expect("it ends by itself");
}

/// Those who wait for a map whose disk hangs are a share of all requests, and of each caller: the others are told so at
/// once, and other maps are served.
#[tokio::test(flavor = "multi_thread")]
async fn requests_for_a_map_whose_disk_hangs_keep_none_for_other_maps_out() {
    const REQUESTS_MAX: usize = 16;
    let data = tempfile::tempdir().unwrap();
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    for name in ["well", "sleeps", "hangs"] {
        let map = format!("{}/v1/maps/{name}", server.http);
        client().put(&map).json(&json!({"resolution_m": 0.1})).send().await.unwrap();
    }
    assert_eq!(server.stop(), Some(0));
    for file in fs::read_dir(folder_of(data.path(), "hangs")).unwrap().map(|file| file.unwrap().path()) {
        fs::remove_file(&file).unwrap();
        make_hang(&file);
    }

    let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
    serve.args(["serve", "--json", "--data-dir", data.path().to_str().unwrap(), "--drain-seconds", "1"]);
    serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0", "--log-level", "error"]);
    serve.env("MROL_LIMITS__REQUESTS_MAX", REQUESTS_MAX.to_string());
    serve.env("MROL_MAPS__SLEEP_AFTER_S", "600");
    let server = Process::of(serve);
    let request = |name: &str| client().get(format!("{}/v1/maps/{name}", server.http));
    let map = |name: &str| request(name).send();
    assert_eq!(map("well").await.unwrap().status(), StatusCode::OK);
    // Three quarters of all requests may wait, half of these for one map, and half of those by one caller; who is
    // refused hears it while the others wait.
    let waiting = REQUESTS_MAX * 3 / 4 / 2 / 2;
    let mut asked = JoinSet::new();
    // So many at a time that those who are refused find a place in work.
    for more in [2 * waiting, REQUESTS_MAX - waiting] {
        (0..more).for_each(|_| drop(asked.spawn(map("hangs"))));
        while asked.len() > waiting {
            let refused = asked.join_next().await.unwrap().unwrap().unwrap();
            assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
            assert_eq!(json_of(refused).await["reason"], "catalog_busy");
        }
    }
    assert_eq!(map("well").await.unwrap().status(), StatusCode::OK);
    // It sleeps, and is opened for the same caller.
    assert_eq!(map("sleeps").await.unwrap().status(), StatusCode::OK);
    // Once its opening takes too long, nobody waits for it any more.
    let soon = async || request("hangs").timeout(Duration::from_secs(2)).send().await;
    wait_until(async || {
        matches!(soon().await, Ok(refused) if refused.status() == StatusCode::SERVICE_UNAVAILABLE
            && refused.headers()["retry-after"] == "10")
    })
    .await;
    server.signal("TERM");
    code_at_end(server).await.expect("it ends by itself");
}

#[tokio::test(flavor = "multi_thread")]
async fn with_a_disk_that_hangs_at_the_end_it_ends_within_its_bound() {
    let data = tempfile::tempdir().unwrap();
    let log = data.path().join("log");
    let server = Process::start_with_log(
        data.path().to_str().unwrap(),
        &["--drain-seconds", "1"],
        "warn",
        File::create(&log).unwrap().into(),
    );
    let map = format!("{}/v1/maps/a", server.http);
    client().put(&map).json(&json!({"resolution_m": 0.1})).send().await.unwrap();
    let scan = json!({"robot": "r", "points": row(9), "guess": identity_json(), "align": false});
    let put = client().post(format!("{map}/scans")).json(&scan).send().await.unwrap();
    assert_eq!(put.status(), StatusCode::OK);
    let folder = fs::read_dir(data.path().join("maps")).unwrap().next().unwrap().unwrap().path();
    make_hang(&folder.join(".unfinished-snapshot-00000000000000000001.mrol"));
    server.signal("TERM");
    assert_ne!(code_at_end(server).await, Some(0));
    let said = fs::read_to_string(&log).unwrap();
    assert!(said.contains("saving the maps took longer than"), "{said}");

    // What was acknowledged is there without the snapshot.
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    let described = client().get(format!("{}/v1/maps/a", server.http)).send().await.unwrap();
    assert_eq!(json_of(described).await["revision"], 1);
    assert_eq!(server.stop(), Some(0));
}
