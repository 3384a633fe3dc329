//! Start, health, metrics, going down and coming back.

use std::fs::{self, File};
use std::process::Command;
use std::time::{Duration, Instant};

use mrol::config::Config;
use mrol::server::Server;
use mrol::service::Limits;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_stream::StreamExt;
use tonic::Code;
use tonic_health::pb::health_client::HealthClient;
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse};

use crate::support::daemon::{
    Daemon, PATIENCE, bytes_of, client, json_of, pose_json, query_pb, row, scan_pb, wait_until,
};
use crate::support::map_folders::folder_of;
use crate::support::process::Process;

/// A scan that takes a while to align: a floor, two walls and what stands about.
fn large_scan(points: usize) -> Vec<[f32; 3]> {
    let place = |i: usize| {
        let (u, v) = ((i * 7919 % 10_007) as f32 / 1000.0, (i * 104_729 % 10_007) as f32 / 1000.0);
        match i % 4 {
            0 => [u, v, 0.0],
            1 => [u, 0.0, v / 4.0],
            2 => [0.0, u, v / 4.0],
            _ => [u, (u * 3.0).sin() + 5.0, v / 10.0],
        }
    };
    (0..points).map(place).collect()
}

/// Requests that were read and are not answered yet.
const IN_WORK: &str = r#"mrol_requests_in_flight{state="in_work"}"#;

#[tokio::test(flavor = "multi_thread")]
async fn idle_streams_and_half_open_connections_do_not_keep_it_from_going_down() {
    // Longer than the test has patience.
    let daemon = Daemon::start_with(|config| config.drain_seconds = 3600).await;
    daemon.make_map("a").await;
    // A stream whose client stays, one that was never used, connections that say nothing or half a sentence,
    // and a watcher of its health.
    let (send, requests) = tokio::sync::mpsc::channel(1);
    send.send(query_pb("a", &row(1))).await.unwrap();
    let requests = tokio_stream::wrappers::ReceiverStream::new(requests);
    let mut answers = daemon.occupancy().await.query_points_stream(requests).await.unwrap().into_inner();
    answers.message().await.unwrap().unwrap();
    let silent = tokio_stream::pending();
    let mut silent = daemon.mapping().await.insert_scan_stream(silent).await.unwrap().into_inner();
    let _half_open = [TcpStream::connect(daemon.grpc).await, TcpStream::connect(daemon.http).await];
    let mut half = TcpStream::connect(daemon.http).await.unwrap();
    half.write_all(b"POST /v1/maps/a/occupancy HTTP/1.1\r\nHost: a\r\nContent-Le").await.unwrap();
    let mut health = HealthClient::new(daemon.channel().await);
    let watch = HealthCheckRequest { service: "mrol.v1.Mapping".into() };
    let mut watched = health.watch(watch).await.unwrap().into_inner();
    assert_eq!(watched.message().await.unwrap().unwrap().status, 1);

    let stopping = daemon.tell_to_stop();
    for answers in [answers.message().await.unwrap_err(), silent.message().await.unwrap_err()] {
        assert_eq!((answers.code(), answers.message()), (Code::Unavailable, "server is draining"));
    }
    assert_eq!(watched.message().await.unwrap(), Some(HealthCheckResponse { status: 2 }));
    stopping.stopped().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_in_flight_is_finished_and_what_is_new_is_refused() {
    let daemon = Daemon::start_with(|config| config.limits.min_revision_wait_max_s = 1.5).await;
    daemon.make_map("a").await;
    assert_eq!(json_of(daemon.get("/readyz").await).await, json!({"ready": true}));
    let waiting = json!({"points": row(1), "min_revision": 9});
    let (waiting, url) = (client().post(daemon.url("/v1/maps/a/occupancy")).json(&waiting), daemon.url(""));
    let waiting = tokio::spawn(waiting.send());
    wait_until(async || daemon.metric(IN_WORK).await == Some(1.0)).await;

    let stopping = daemon.tell_to_stop();
    let get = async |path: &str| client().get(format!("{url}{path}")).send().await.unwrap();
    wait_until(async || get("/readyz").await.status() == StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(json_of(get("/readyz").await).await, json!({"ready": false, "reason": "draining"}));
    assert_eq!(get("/livez").await.status(), StatusCode::OK);
    let refused = get("/v1/maps").await;
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    let expected = json!({
        "title": "Service Unavailable", "status": 503, "detail": "server is draining", "code": "unavailable", "reason": "draining",
    });
    assert_eq!(json_of(refused).await, expected);

    // Its own bound ends it, not the server's end.
    assert_eq!(waiting.await.unwrap().unwrap().status(), StatusCode::GATEWAY_TIMEOUT);
    stopping.stopped().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn told_a_second_time_it_ends_at_once() {
    let data = tempfile::tempdir().unwrap();
    // Longer than the test has patience.
    let server = Process::start(data.path().to_str().unwrap(), &["--drain-seconds", "3600"]);
    let address = server.http.strip_prefix("http://").unwrap();
    // A request in flight: its body is waited for, and never comes.
    let mut stuck = TcpStream::connect(address).await.unwrap();
    let head = "PUT /v1/maps/a HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: 9\r\n\
                expect: 100-continue\r\n\r\n";
    stuck.write_all(head.as_bytes()).await.unwrap();
    let mut answer = [0; 12];
    stuck.read_exact(&mut answer).await.unwrap();
    assert_eq!(&answer, b"HTTP/1.1 100");
    server.signal("TERM");
    let ready = format!("{}/readyz", server.http);
    wait_until(async || match client().get(&ready).send().await {
        Ok(answer) => answer.status() == StatusCode::SERVICE_UNAVAILABLE,
        Err(_) => panic!("it went down with a request in flight"),
    })
    .await;
    server.signal("TERM");
    let ended = tokio::time::timeout(PATIENCE, tokio::task::spawn_blocking(|| server.ended())).await;
    assert_eq!(ended.expect("its end").unwrap(), Some(130));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_takes_longer_than_the_bound_is_cut() {
    let daemon = Daemon::start_with(|config| {
        config.limits.min_revision_wait_max_s = 600.0;
        config.drain_seconds = 1;
    });
    let daemon = daemon.await;
    daemon.make_map("a").await;
    let forever = pb::QueryPointsRequest { min_revision: Some(9), ..query_pb("a", &row(1)) };
    let mut planner = daemon.occupancy().await;
    let unary = tokio::spawn(async move { planner.query_points(forever).await });
    let forever = pb::QueryPointsRequest { min_revision: Some(9), ..query_pb("a", &row(1)) };
    let requests = tokio_stream::once(forever).chain(tokio_stream::pending());
    let mut stream = daemon.occupancy().await.query_points_stream(requests).await.unwrap().into_inner();
    let both_wait = async || {
        daemon.metric(IN_WORK).await == Some(1.0) && daemon.metric("mrol_streams_open").await == Some(1.0)
    };
    wait_until(both_wait).await;

    let start = Instant::now();
    let stopping = daemon.tell_to_stop();
    assert_eq!(unary.await.unwrap().unwrap_err().code(), Code::Unavailable);
    assert_eq!(stream.message().await.unwrap_err().code(), Code::Unavailable);
    stopping.stopped().await;
    // Less than the bound that is the default.
    assert!(start.elapsed() < Duration::from_secs(9), "it took {:?}", start.elapsed());
}

#[tokio::test]
async fn maps_survive_a_restart() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.make_map("gone").await;
    let mut robot = daemon.mapping().await;
    let mut scan = scan_pb("a", "r", &row(30));
    scan.scan.as_mut().unwrap().scan_id = Some(7);
    let first = robot.insert_scan(scan.clone()).await.unwrap().into_inner();
    daemon.post("/v1/maps/a/deletions", json!({"points": row(3)})).await;
    daemon.delete("/v1/maps/gone").await;
    let before = daemon.contents("a").await;
    let trajectory = json_of(daemon.get("/v1/maps/a/trajectory").await).await;

    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("a").await, before);
    assert_eq!(before.1.len(), 27);
    assert_eq!(json_of(daemon.get("/v1/maps/a/trajectory").await).await, trajectory);
    assert_eq!(daemon.get("/v1/maps/gone").await.status(), StatusCode::NOT_FOUND);
    // It still knows the scans it has accepted.
    let again = daemon.mapping().await.insert_scan(scan).await.unwrap().into_inner();
    assert!(again.replayed && again.accepted);
    // What the map held then is not known any more.
    let first_version = first.version.map(|version| pb::MapVersion { content_hash: None, ..version });
    assert_eq!((again.version, again.new_voxels), (first_version, first.new_voxels));
}

#[tokio::test]
async fn changed_maps_are_written_to_snapshots_beside_the_running_server() {
    // Viewpoints lie in files of their own, which a snapshot names: without any it is whole.
    let daemon = Daemon::start_with(|config| {
        config.store.snapshot_interval_s = 1;
        config.limits.viewpoint_bytes_max = 0;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(5)).await;
    let snapshot = folder_of(daemon.data.path(), "a").join("snapshot-00000000000000000001.mrol");
    wait_until(async || snapshot.exists()).await;
    // It is a map file like any other: another server takes it in.
    let copied = tempfile::tempdir().unwrap();
    std::fs::create_dir(copied.path().join("maps")).unwrap();
    std::fs::copy(&snapshot, copied.path().join("maps/b.mrol")).unwrap();
    let other = Daemon::start_in(copied, |_| {}).await;
    assert_eq!(other.contents("b").await, daemon.contents("a").await);
}

#[tokio::test]
async fn metrics_count_what_was_done_and_forget_maps_that_are_gone() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    daemon.post_bytes("/v1/maps/a/occupancy", bytes_of(&row(7))).await;
    daemon.post_bytes("/v1/maps/a/occupancy?level=9", bytes_of(&row(7))).await;
    let far = json!({"robot": "r", "points": row(9), "guess": pose_json([500.0; 3])});
    daemon.post("/v1/maps/a/scans", far).await;
    daemon.post("/v1/maps/a/deletions", json!({"points": row(3)})).await;
    daemon.get("/no/such/route").await;
    let mut planner = daemon.occupancy().await;
    let bloom = pb::QueryPointsRequest { lookup: pb::Lookup::Bloom.into(), ..query_pb("a", &row(5)) };
    let stream = planner.query_points_stream(tokio_stream::iter([bloom.clone(), bloom])).await.unwrap();
    assert_eq!(stream.into_inner().collect::<Vec<_>>().await.len(), 2);
    planner.query_points(query_pb("b", &row(1))).await.unwrap_err();

    let answer = daemon.get("/metrics").await;
    assert!(answer.headers()["content-type"].to_str().unwrap().starts_with("text/plain"));
    let text = answer.text().await.unwrap();
    for line in [
        r#"mrol_requests_total{protocol="http",operation="CreateMap",code="201"} 1"#,
        r#"mrol_requests_total{protocol="http",operation="QueryPoints",code="200"} 1"#,
        r#"mrol_requests_total{protocol="http",operation="QueryPoints",code="400"} 1"#,
        r#"mrol_requests_total{protocol="http",operation="unknown",code="404"} 1"#,
        r#"mrol_requests_total{protocol="grpc",operation="QueryPointsStream",code="ok"} 2"#,
        r#"mrol_requests_total{protocol="grpc",operation="QueryPoints",code="not_found"} 1"#,
        r#"mrol_request_seconds_count{protocol="http",operation="InsertScan"} 2"#,
        r#"mrol_points_queried_total{map="a",lookup="exact"} 7"#,
        r#"mrol_points_queried_total{map="a",lookup="bloom"} 10"#,
        r#"mrol_scans_total{map="a",verdict="accepted"} 1"#,
        r#"mrol_scans_total{map="a",verdict="low_overlap"} 1"#,
        r#"mrol_robot_scans_total{robot="r",verdict="low_overlap"} 1"#,
        r#"mrol_robot_scans_total{robot="setup",verdict="accepted"} 1"#,
        r#"mrol_connections_open{listener="grpc"} 1"#,
        r#"mrol_connections_accepted_total{listener="http"} "#,
        r#"mrol_build_info{version=""#,
        r#"mrol_journal_sync_seconds_bucket{map="a",le="60"} 2"#,
        r#"mrol_commit_seconds_count{map="a"} 2"#,
        r#"mrol_job_wait_seconds_bucket{pool="mapping",le="+Inf"} "#,
        r#"mrol_map_snapshot_age_seconds{map="a"} "#,
        r#"mrol_map_snapshot_failures_total{map="a"} 0"#,
        r#"mrol_map_disk_bytes{map="a"} "#,
        r#"mrol_voxels_removed_total{map="a"} 3"#,
        r#"mrol_map_voxels{map="a",level="0"} 17"#,
        r#"mrol_map_revision{map="a"} 2"#,
        r#"mrol_map_scans{map="a"} 1"#,
        r#"mrol_map_poses{map="a"} 1"#,
        r#"mrol_map_set_bytes{map="a"} "#,
        r#"mrol_map_filter_bytes{map="a",level="0",part="plane"} "#,
        r#"mrol_filter_false_positive_rate{map="a",level="0",kind="expected"} "#,
        r#"mrol_filter_false_positive_rate{map="a",level="0",kind="ideal"} "#,
        r#"mrol_filter_false_positive_rate{map="a",level="0",kind="measured"} "#,
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    assert!(daemon.metric("mrol_map_disk_bytes{map=\"a\"}").await.unwrap() > 100.0);
    for family in text.lines().filter_map(|line| line.strip_prefix("# TYPE ")) {
        let (name, kind) = family.split_once(' ').unwrap();
        assert_eq!(name.ends_with("_total"), kind == "counter", "{family}");
    }
    daemon.delete("/v1/maps/a").await;
    let text = daemon.get("/metrics").await.text().await.unwrap();
    assert!(!text.contains("mrol_map_voxels{map=\"a\""), "{text}");
    assert!(!text.contains("mrol_voxels_removed_total{map=\"a\"}"), "{text}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn probes_answer_while_every_pool_thread_is_busy() {
    let daemon = Daemon::start_with(|config| {
        config.threads.query = 2;
        config.threads.mapping = 2;
    });
    let daemon = daemon.await;
    daemon.put("/v1/maps/a", json!({"resolution_m": 0.02, "levels": 6})).await;
    daemon.put_in("a", &large_scan(150_000)).await;
    let scan = json!({"robot": "r", "points": large_scan(150_000), "guess": pose_json([0.3, 0.2, 0.1])});
    let align = client().post(daemon.url("/v1/maps/a/alignment")).json(&scan);
    let busy: Vec<_> = (0..6).map(|_| tokio::spawn(align.try_clone().unwrap().send())).collect();
    let mut health = HealthClient::new(daemon.channel().await);
    let (begun, mut slowest) = (Instant::now(), Duration::ZERO);
    let mut asked = 0;
    while !busy.iter().all(|aligned| aligned.is_finished()) {
        let start = Instant::now();
        assert_eq!(daemon.get("/livez").await.text().await.unwrap(), "ok");
        assert_eq!(daemon.get("/readyz").await.status(), StatusCode::OK);
        assert_eq!(health.check(HealthCheckRequest::default()).await.unwrap().into_inner().status, 1);
        slowest = slowest.max(start.elapsed());
        asked += 1;
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let all = begun.elapsed();
    for aligned in busy {
        assert_eq!(aligned.await.unwrap().unwrap().status(), StatusCode::OK);
    }
    assert!(asked > 3, "the alignments were over before the probes were asked");
    // Who waited for a thread would wait for a third of all.
    let bound = (all / 4).max(Duration::from_secs(1));
    assert!(slowest < bound, "three probes took {slowest:?}, all alignments {all:?}");
}

#[tokio::test]
async fn an_address_that_is_taken_is_named() {
    let daemon = Daemon::start().await;
    let mut config = Config { data_dir: "".into(), ..Config::default() };
    config.http.listen.set_port(0);
    config.grpc.listen = daemon.grpc;
    let error = Server::bind(config).await.unwrap_err().to_string();
    assert!(error.contains(&format!("grpc cannot listen on {}", daemon.grpc)), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn with_few_open_files_it_keeps_fewer_connections_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("log");
    let mut serve = Command::new("sh");
    serve.args(["-c", "ulimit -n 512 && exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_mrol")]);
    serve.args(["serve", "--json", "--data-dir", "", "--log-level", "warn"]);
    serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]);
    serve.stderr(File::create(&log).expect("a log"));
    Process::of(serve).stop();
    let said = fs::read_to_string(&log).expect("a log");
    let Limits { connections_max, connections_reserved, .. } = Limits::default();
    let needed = format!("needed={}", 512 + 2 * (connections_max + connections_reserved));
    for part in ["fewer open files", "open_files=512", &needed, "connections_max=128"] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hangup_with_nothing_to_read_again_ends_nothing() {
    let data = tempfile::tempdir().unwrap();
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    server.signal("HUP");
    server.signal("HUP");
    // The signals were sent before the request, and the process would have died of them before it answered.
    for _ in 0..20 {
        let live = client().get(format!("{}/livez", server.http)).send().await.expect("a server that lives");
        assert_eq!(live.status(), StatusCode::OK);
    }
    assert_eq!(server.stop(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn before_it_drains_it_says_that_it_is_not_ready_and_serves_on() {
    let daemon = Daemon::start_with(|config| config.drain_delay_s = 6).await;
    daemon.make_map("a").await;
    let mut health = HealthClient::new(daemon.channel().await);
    let (grpc, url) = (daemon.grpc, daemon.url(""));
    let stopping = daemon.tell_to_stop();
    let get = async |path: &str| client().get(format!("{url}{path}")).send().await.unwrap();
    wait_until(async || get("/readyz").await.status() == StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(json_of(get("/readyz").await).await, json!({"ready": false, "reason": "draining"}));
    assert_eq!(health.check(HealthCheckRequest::default()).await.unwrap().into_inner().status, 2);
    // Whoever has not heard of it yet is served, also over a new connection.
    assert_eq!(get("/v1/maps/a").await.status(), StatusCode::OK);
    let made = client().put(format!("{url}/v1/maps/b")).json(&json!({"resolution_m": 0.1})).send().await;
    assert_eq!(made.unwrap().status(), StatusCode::CREATED);
    TcpStream::connect(grpc).await.expect("a listener");
    stopping.stopped().await;
    TcpStream::connect(grpc).await.expect_err("no listener");
}

#[cfg(feature = "cluster")]
#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_has_not_joined_its_cluster_says_by_both_protocols_that_it_is_not_ready() {
    let folder = tempfile::tempdir().unwrap();
    // Nothing listens there.
    let options = ["--cluster", "nats://127.0.0.1:1", "--node", "n1"];
    let server = Process::start(folder.path().to_str().unwrap(), &options);
    let ready = client().get(format!("{}/readyz", server.http)).send().await.unwrap();
    assert_eq!(ready.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(json_of(ready).await, json!({"ready": false, "reason": "behind"}));
    let channel =
        tonic::transport::Endpoint::from_shared(server.grpc.clone()).unwrap().connect().await.unwrap();
    let mut health = HealthClient::new(channel);
    assert_eq!(health.check(HealthCheckRequest::default()).await.unwrap().into_inner().status, 2);
    // It lives, and answers.
    let live = client().get(format!("{}/livez", server.http)).send().await.unwrap();
    assert_eq!(live.status(), StatusCode::OK);
    assert_eq!(server.stop(), Some(0));
}
