//! Work whose caller is gone stops: while it waits, while it is in hand, and in streams; a deadline is a caller that
//! goes. Where all places to wait are taken, a request is refused and told when to come again.

use std::time::{Duration, Instant};

use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::json;
use tokio::task::JoinHandle;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Request, Status};

use crate::support::daemon::{
    Daemon, PATIENCE, bytes_of, client, corner, guess_pb, identity_json, json_of, points_pb, query_pb, row,
    scan_pb,
};

/// So many that an ascent with all of them takes minutes.
const POINTS: usize = 1_000_000;

/// A daemon of one thread for alignments, one for insertions, and a map to align to.
async fn daemon() -> Daemon {
    let daemon = Daemon::start_with(|config| {
        config.threads.mapping = 1;
        config.threads.alignment = 1;
        // What ends work here is that nobody waits for it.
        config.limits.alignment_time_max_s = 3600.0;
        config.limits.insertion_time_max_s = 3600.0;
        config.limits.jobs_waiting_max = 4;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    daemon
}

/// An alignment that takes minutes: the corner's points over and over, off by so much that each step is one up.
fn endless() -> pb::AlignScanRequest {
    let points: Vec<[f32; 3]> = corner().into_iter().cycle().take(POINTS).collect();
    pb::AlignScanRequest {
        map: "a".into(),
        scan: Some(pb::Scan { robot: "r1".into(), points: points_pb(&points), ..Default::default() }),
        guess: guess_pb([0.11, 0.12, 0.13]),
        method: pb::Method::Overlap as i32,
        ..Default::default()
    }
}

async fn align(daemon: &Daemon) -> JoinHandle<Result<tonic::Response<pb::AlignScanResponse>, Status>> {
    let mut robot = daemon.mapping().await;
    tokio::spawn(async move { robot.align_scan(endless()).await })
}

/// What `/metrics` says of the jobs of a pool.
async fn jobs_of(daemon: &Daemon, pool: &str, what: &str) -> u64 {
    daemon.metric(&format!("mrol_jobs_{what}{{pool=\"{pool}\"}}")).await.expect("a gauge") as u64
}

/// Of those for alignments and insertions together: a test here has jobs in one of them.
async fn jobs(daemon: &Daemon, what: &str) -> u64 {
    jobs_of(daemon, "alignment", what).await + jobs_of(daemon, "mapping", what).await
}

async fn until(daemon: &Daemon, what: &str, count: u64) {
    let start = Instant::now();
    while jobs(daemon, what).await != count {
        assert!(start.elapsed() < PATIENCE, "{what} is {}, not {count}", jobs(daemon, what).await);
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_whose_callers_have_gone_are_not_begun_and_one_in_hand_stops() {
    let daemon = daemon().await;
    let begun = jobs(&daemon, "begun_total").await;
    let in_hand = align(&daemon).await;
    until(&daemon, "running", 1).await;
    let mut waiting = Vec::new();
    for _ in 0..4 {
        waiting.push(align(&daemon).await);
    }
    until(&daemon, "waiting", 4).await;
    let refused = daemon.mapping().await.align_scan(endless()).await.unwrap_err();
    assert!(refused.message().contains("jobs_waiting_max is 4"), "{refused:?}");
    let scan = json!({"robot": "r2", "points": row(10), "guess": identity_json()});
    let refused = daemon.post("/v1/maps/a/alignment", scan).await;
    assert_eq!(refused.status(), StatusCode::TOO_MANY_REQUESTS);
    assert_eq!(refused.headers()["retry-after"], "1");
    let detail = json_of(refused).await["detail"].as_str().expect("a detail").to_owned();
    assert!(detail.contains("jobs_waiting_max is 4"), "{detail}");

    waiting.iter().for_each(JoinHandle::abort);
    until(&daemon, "waiting", 0).await;
    assert_eq!(jobs(&daemon, "cancelled_total").await, 4);
    in_hand.abort();
    until(&daemon, "cancelled_total", 5).await;
    until(&daemon, "running", 0).await;
    assert_eq!(jobs(&daemon, "begun_total").await, begun + 1);
    // There is room again.
    daemon.mapping().await.insert_scan(scan_pb("a", "r2", &row(10))).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn an_http_client_that_disconnects_takes_its_work_along() {
    let daemon = daemon().await;
    let points = bytes_of(&corner().into_iter().cycle().take(POINTS).collect::<Vec<_>>());
    let url = daemon.url("/v1/maps/a/alignment?robot=r1&method=overlap&guess=0.11,0.12,0.13,0,0,0,1");
    let post = client().post(url).header("content-type", "application/octet-stream").body(points);
    let gone = tokio::spawn(post.send());
    until(&daemon, "running", 1).await;
    gone.abort();
    until(&daemon, "cancelled_total", 1).await;
    assert_eq!(jobs(&daemon, "running").await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_does_not_wait_for_its_answer_is_told_of() {
    let daemon = daemon().await;
    let points = bytes_of(&corner().into_iter().cycle().take(POINTS).collect::<Vec<_>>());
    let url = daemon.url("/v1/maps/a/scans?robot=hasty&method=overlap&guess=0.11,0.12,0.13,0,0,0,1");
    let post = client().post(url).header("content-type", "application/octet-stream").body(points);
    let gone = tokio::spawn(post.send());
    until(&daemon, "running", 1).await;
    gone.abort();
    until(&daemon, "cancelled_total", 1).await;
    let told = json_of(daemon.get("/v1/maps/a/events?robot=hasty").await).await;
    assert_eq!(told["events"][0]["error"]["reason"], "caller_gone", "{told}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deadline_ends_a_call_and_its_work() {
    let daemon = daemon().await;
    let mut request = Request::new(endless());
    // It may be over before the work is begun; then nobody waits for it.
    request.metadata_mut().insert("grpc-timeout", "2S".parse().unwrap());
    let late = daemon.mapping().await.align_scan(request).await.unwrap_err();
    // The client's own clock may be first.
    assert!(matches!(late.code(), Code::DeadlineExceeded | Code::Cancelled), "{late:?}");
    until(&daemon, "running", 0).await;
    assert_eq!(jobs(&daemon, "waiting").await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deadline_ends_a_stream_whose_client_goes_on() {
    let daemon = daemon().await;
    let (send, requests) = tokio::sync::mpsc::channel(1);
    let mut requests = Request::new(ReceiverStream::new(requests));
    requests.metadata_mut().insert("grpc-timeout", "2S".parse().unwrap());
    let mut answers = daemon.occupancy().await.query_points_stream(requests).await.unwrap().into_inner();
    send.send(query_pb("a", &row(1))).await.unwrap();
    answers.message().await.unwrap().unwrap();
    let late = tokio::time::timeout(PATIENCE, answers.message()).await.unwrap().unwrap_err();
    assert_eq!(late.code(), Code::DeadlineExceeded, "{late:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_that_is_dropped_takes_its_request_in_hand_along() {
    let daemon = daemon().await;
    let pb::AlignScanRequest { map, scan, guess, method, .. } = endless();
    let scan = pb::InsertScanRequest { map, scan, guess, method, ..Default::default() };
    let revision = daemon.contents("a").await.0;
    let answers = daemon.mapping().await.insert_scan_stream(tokio_stream::once(scan)).await.unwrap();
    until(&daemon, "running", 1).await;
    drop(answers);
    until(&daemon, "cancelled_total", 1).await;
    assert_eq!((jobs(&daemon, "running").await, daemon.contents("a").await.0), (0, revision));
}

#[tokio::test(flavor = "multi_thread")]
async fn any_number_of_alignments_keeps_no_scan_from_being_inserted() {
    let daemon = daemon().await;
    let mut readers = vec![align(&daemon).await];
    until(&daemon, "running", 1).await;
    for _ in 0..4 {
        readers.push(align(&daemon).await);
    }
    until(&daemon, "waiting", 4).await;
    let mut robot = daemon.mapping().await;
    let inserted = tokio::time::timeout(PATIENCE, robot.insert_scan(scan_pb("a", "r2", &row(10)))).await;
    inserted.expect("a thread of its own").unwrap();
    assert_eq!(jobs_of(&daemon, "alignment", "running").await, 1);
    readers.iter().for_each(JoinHandle::abort);
    until(&daemon, "running", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_takes_too_long_is_ended_and_the_limit_named() {
    let daemon = Daemon::start_with(|config| {
        config.limits.alignment_time_max_s = 0.2;
        config.limits.insertion_time_max_s = 0.3;
        config.limits.undo_time_max_s = 0.0;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    let late = daemon.mapping().await.align_scan(endless()).await.unwrap_err();
    assert_eq!(late.code(), Code::DeadlineExceeded, "{late:?}");
    assert!(late.message().contains("alignment_time_max_s allows, which is 200ms"), "{late:?}");
    let pb::AlignScanRequest { map, scan, guess, method, .. } = endless();
    let scan = pb::InsertScanRequest { map, scan, guess, method, ..Default::default() };
    let late = daemon.mapping().await.insert_scan(scan).await.unwrap_err();
    assert_eq!(late.code(), Code::DeadlineExceeded, "{late:?}");
    assert!(late.message().contains("insertion_time_max_s allows, which is 300ms"), "{late:?}");

    let late =
        json_of(daemon.post("/v1/maps/a/undo", serde_json::json!({"revision": 1})).await).await.to_string();
    assert!(late.contains("time_limit") && late.contains("undo_time_max_s allows, which is 0ns"), "{late}");
}
