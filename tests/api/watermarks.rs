//! Where disk or memory is nearly full, changes are refused and reads go on, until there is room again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use mrol::config::Config;
use mrol::service::{Gauges, MemoryReading, Readings};
use mrol::wire::pb;
use parking_lot::Mutex;
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};
use tonic::{Code, Status};

use crate::support::daemon::{
    Daemon, PATIENCE, client, identity_json, json_of, points_pb, query_pb, row, scan_pb,
};
use crate::support::map_folders::folder_of;
use crate::support::skipped::skipped;

const MIB: u64 = 1 << 20;

/// Gauges that a test turns.
#[derive(Debug, Default)]
struct Dials(Mutex<Readings>);

impl Gauges for Dials {
    fn disk_free_bytes(&self) -> Option<u64> {
        self.0.lock().disk_free_bytes
    }

    fn memory(&self) -> Option<MemoryReading> {
        self.0.lock().memory
    }
}

impl Dials {
    fn turn_disk(&self, free_mib: u64) {
        self.0.lock().disk_free_bytes = Some(free_mib * MIB);
    }

    fn turn_memory(&self, resident_mib: u64) {
        let (resident_bytes, allowed_bytes) = (resident_mib * MIB, 1000 * MIB);
        self.0.lock().memory = Some(MemoryReading { resident_bytes, allowed_bytes });
    }
}

/// A server with a map of ten voxels, and its gauges.
async fn with_dials(change: impl FnOnce(&mut Config)) -> (Daemon, Arc<Dials>) {
    let dials = Arc::new(Dials::default());
    dials.turn_disk(10_000);
    dials.turn_memory(100);
    let daemon = Daemon::start_with_gauges(Arc::clone(&dials) as Arc<dyn Gauges>, change).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    (daemon, dials)
}

async fn ready(daemon: &Daemon) -> Value {
    let ready = daemon.get("/readyz").await;
    assert_eq!(ready.status(), StatusCode::OK, "reads go on, so it is ready");
    json_of(ready).await
}

/// Waits until the server has looked, and refuses changes for `reasons`.
async fn refuses_for(daemon: &Daemon, reasons: &[&str]) {
    let start = Instant::now();
    let wanted = if reasons.is_empty() { Value::Null } else { json!(reasons) };
    while ready(daemon).await["writes_refused"] != wanted {
        assert!(start.elapsed() < PATIENCE, "it never refused for {reasons:?} alone");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn scan_json() -> Value {
    json!({"robot": "r", "points": [[9.0, 9.0, 9.0]], "guess": identity_json(), "align": false})
}

/// A scan under a number, which may be sent again.
async fn insert_numbered(daemon: &Daemon, scan_id: u64) -> Response {
    let mut scan = scan_json();
    scan["scan_id"] = scan_id.into();
    daemon.post("/v1/maps/a/scans", scan).await
}

/// A deletion under an id, which may be sent again.
async fn delete_named(daemon: &Daemon, request_id: &str) -> Response {
    daemon.post("/v1/maps/a/deletions", json!({"points": row(1), "request_id": request_id})).await
}

async fn insert(daemon: &Daemon) -> Response {
    daemon.post("/v1/maps/a/scans", scan_json()).await
}

async fn delete_first_voxel(daemon: &Daemon) -> Response {
    daemon.post("/v1/maps/a/deletions", json!({"points": row(1)})).await
}

async fn undo_first_scan(daemon: &Daemon) -> Response {
    daemon.post("/v1/maps/a/undo", json!({"revision": 1})).await
}

async fn put_keep_out(daemon: &Daemon) -> Response {
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    daemon.put("/v1/maps/a/keep-outs/dock", sphere).await
}

async fn make(daemon: &Daemon, map: &str) -> Response {
    daemon.put(&format!("/v1/maps/{map}"), json!({"resolution_m": 0.1, "levels": 4})).await
}

async fn restore(daemon: &Daemon, file: Vec<u8>) -> Response {
    let put = client().put(daemon.url("/v1/maps/restored/snapshot"));
    put.header("content-type", "application/octet-stream").body(file).send().await.unwrap()
}

/// Checks a refusal over HTTP; its message.
async fn refused(answer: Response, status: StatusCode, reason: &str) -> String {
    assert_eq!(answer.status(), status);
    assert_eq!(answer.headers()["retry-after"], "5");
    let error = json_of(answer).await;
    assert_eq!((&error["code"], &error["reason"]), (&json!("resource_exhausted"), &json!(reason)));
    error["detail"].as_str().unwrap().to_owned()
}

/// Checks a refusal over gRPC.
fn refused_call<A: std::fmt::Debug>(answer: Result<A, Status>, reason: &str) {
    let status = answer.unwrap_err();
    assert_eq!(status.code(), Code::ResourceExhausted, "{status}");
    assert_eq!(status.metadata().get("mrol-reason").unwrap(), reason);
    assert_eq!(status.metadata().get("grpc-retry-pushback-ms").unwrap(), "5000");
}

fn deletion_pb() -> pb::DeleteVoxelsRequest {
    let target = points_pb(&row(1)).map(pb::delete_voxels_request::Target::Points);
    pb::DeleteVoxelsRequest { map: "a".into(), target, ..Default::default() }
}

fn undo_pb() -> pb::UndoRequest {
    let target = Some(pb::undo_request::Target::Revision(1));
    pb::UndoRequest { map: "a".into(), target, ..Default::default() }
}

fn new_map_pb() -> pb::CreateMapRequest {
    let settings = pb::MapSettings { resolution_m: 0.1, levels: Some(4), ..Default::default() };
    pb::CreateMapRequest { map: "b".into(), settings: Some(settings) }
}

/// Questions of every kind are answered.
async fn is_read(daemon: &Daemon) {
    let answer = daemon.occupancy().await.query_points(query_pb("a", &row(10))).await.unwrap().into_inner();
    assert_eq!(answer.occupied.as_ref(), [0xff, 0x03]);
    assert_eq!(daemon.contents("a").await.1.len(), 10);
    assert_eq!(daemon.post("/v1/maps/a/alignment", scan_json()).await.status(), StatusCode::OK);
    assert_eq!(daemon.get("/v1/maps/a/snapshot").await.status(), StatusCode::OK);
    // To make a map that is there changes nothing.
    assert_eq!(make(daemon, "a").await.status(), StatusCode::OK);
}

#[tokio::test]
async fn a_full_disk_refuses_every_change_and_no_question_until_there_is_room() {
    let (daemon, dials) = with_dials(|_| {}).await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap().to_vec();
    let before = daemon.contents("a").await;
    dials.turn_disk(100);
    refuses_for(&daemon, &["disk_full"]).await;

    let full = StatusCode::INSUFFICIENT_STORAGE;
    let message = refused(insert(&daemon).await, full, "disk_full").await;
    for part in ["100 MiB", "limits.disk_free_low_mib, 256", "limits.disk_free_resume_mib, 512"] {
        assert!(message.contains(part), "{part} is not in {message}");
    }
    let message = refused(delete_first_voxel(&daemon).await, full, "disk_full").await;
    assert!(message.contains("the journal keeps"), "{message}");
    refused(undo_first_scan(&daemon).await, full, "disk_full").await;
    refused(put_keep_out(&daemon).await, full, "disk_full").await;
    refused(make(&daemon, "b").await, full, "disk_full").await;
    refused(restore(&daemon, file.clone()).await, full, "disk_full").await;

    let (mut mapping, mut maps) = (daemon.mapping().await, daemon.maps().await);
    refused_call(mapping.insert_scan(scan_pb("a", "r", &[[9.0; 3]])).await, "disk_full");
    refused_call(mapping.delete_voxels(deletion_pb()).await, "disk_full");
    refused_call(mapping.undo(undo_pb()).await, "disk_full");
    refused_call(maps.create_map(new_map_pb()).await, "disk_full");
    let restored = pb::RestoreMapRequest { map: "b".into(), data: file.clone().into(), replace: false };
    refused_call(maps.restore_map(tokio_stream::iter([restored])).await, "disk_full");

    is_read(&daemon).await;
    assert_eq!(daemon.contents("a").await, before);
    let metrics = daemon.get("/metrics").await.text().await.unwrap();
    for line in [
        "mrol_disk_free_bytes 104857600",
        "mrol_memory_resident_bytes 104857600",
        r#"mrol_writes_refused{reason="disk_full"} 1"#,
        r#"mrol_writes_refused{reason="memory_full"} 0"#,
    ] {
        assert!(metrics.contains(line), "{line} is not in\n{metrics}");
    }

    dials.turn_disk(512);
    refuses_for(&daemon, &[]).await;
    assert_eq!(insert(&daemon).await.status(), StatusCode::OK);
    assert_eq!(restore(&daemon, file).await.status(), StatusCode::CREATED);
    assert_eq!(daemon.contents("a").await.1.len(), 11);
    daemon.stop().await;
}

#[tokio::test]
async fn full_memory_refuses_what_grows_and_takes_what_shrinks() {
    let (daemon, dials) = with_dials(|_| {}).await;
    let before = daemon.contents("a").await;
    dials.turn_memory(900);
    refuses_for(&daemon, &["memory_full"]).await;

    let full = StatusCode::SERVICE_UNAVAILABLE;
    let message = refused(insert(&daemon).await, full, "memory_full").await;
    for part in ["900 MiB", "limits.memory_high_mib, 850", "limits.memory_resume_mib, 799"] {
        assert!(message.contains(part), "{part} is not in {message}");
    }
    refused(make(&daemon, "b").await, full, "memory_full").await;
    let mut mapping = daemon.mapping().await;
    refused_call(mapping.insert_scan(scan_pb("a", "r", &[[9.0; 3]])).await, "memory_full");
    is_read(&daemon).await;
    assert_eq!(daemon.contents("a").await, before);

    assert_eq!(json_of(delete_first_voxel(&daemon).await).await["removed"], 1);
    assert_eq!(put_keep_out(&daemon).await.status(), StatusCode::OK);
    assert_eq!(daemon.delete("/v1/maps/a/keep-outs/dock").await.status(), StatusCode::OK);
    // To find out in who holds which voxels takes memory as well: there must be some left.
    dials.turn_memory(990);
    let message = refused(undo_first_scan(&daemon).await, full, "memory_full").await;
    assert!(message.contains("an undo takes"), "{message}");
    refused(daemon.get("/v1/maps/a/snapshot").await, full, "memory_full").await;
    dials.turn_memory(900);
    assert_eq!(json_of(undo_first_scan(&daemon).await).await["removed"], 9);
    // Between the marks it stays as it is.
    dials.turn_memory(820);
    dials.turn_disk(100);
    refuses_for(&daemon, &["disk_full", "memory_full"]).await;
    dials.turn_memory(700);
    dials.turn_disk(600);
    refuses_for(&daemon, &[]).await;
    assert_eq!(insert(&daemon).await.status(), StatusCode::OK);
    daemon.stop().await;
}

#[tokio::test]
async fn the_room_on_the_real_disk_counts_from_the_first_request_on_and_a_map_can_be_deleted_for_more() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let data = daemon.stop().await;
    let daemon = Daemon::start_in(data, |config| {
        // An exbibyte.
        config.limits.disk_free_low_mib = 1 << 39;
        config.limits.disk_free_resume_mib = 1 << 40;
    })
    .await;
    refused(insert(&daemon).await, StatusCode::INSUFFICIENT_STORAGE, "disk_full").await;
    assert_eq!(ready(&daemon).await["writes_refused"], json!(["disk_full"]));
    assert_eq!(daemon.contents("a").await.1.len(), 0);
    assert_eq!(daemon.delete("/v1/maps/a").await.status(), StatusCode::NO_CONTENT);
    daemon.stop().await;
}

#[tokio::test]
async fn what_was_done_before_is_answered_again_while_the_disk_is_full() {
    let (daemon, dials) = with_dials(|_| {}).await;
    let first = json_of(insert_numbered(&daemon, 7).await).await;
    assert_eq!(json_of(delete_named(&daemon, "once").await).await["removed"], 1);
    dials.turn_disk(100);
    refuses_for(&daemon, &["disk_full"]).await;

    let again = json_of(insert_numbered(&daemon, 7).await).await;
    assert_eq!((&again["replayed"], &again["revision"]), (&json!(true), &first["revision"]));
    let again = json_of(delete_named(&daemon, "once").await).await;
    assert_eq!((&again["replayed"], &again["removed"]), (&json!(true), &json!(1)));
    let full = StatusCode::INSUFFICIENT_STORAGE;
    refused(insert_numbered(&daemon, 8).await, full, "disk_full").await;
    refused(delete_named(&daemon, "twice").await, full, "disk_full").await;
    daemon.stop().await;
}

async fn snapshot_revision(daemon: &Daemon) -> Value {
    json_of(daemon.get("/v1/maps/a").await).await["storage"]["snapshot_revision"].take()
}

#[tokio::test]
async fn a_snapshot_without_room_is_put_off_and_scans_go_on() {
    let (daemon, dials) = with_dials(|config| config.store.snapshot_interval_s = 1).await;
    // Enough for changes, and nothing to spare.
    dials.turn_disk(256);
    let before = snapshot_revision(&daemon).await;
    for scan_id in 0..4 {
        assert_eq!(insert_numbered(&daemon, scan_id).await.status(), StatusCode::OK);
    }
    // Two snapshots would have been written meanwhile.
    let (start, age) = (Instant::now(), r#"mrol_map_snapshot_age_seconds{map="a"}"#);
    while daemon.metric(age).await.expect("a gauge") < 2.5 {
        assert!(start.elapsed() < PATIENCE, "snapshots are written");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let with_them = json_of(daemon.get("/v1/maps/a").await).await["revision"].take();
    assert_eq!(ready(&daemon).await["writes_refused"], Value::Null);
    // The first may have been taken before there was too little room.
    assert!(snapshot_revision(&daemon).await.as_u64() <= Some(before.as_u64().unwrap() + 1));

    dials.turn_disk(10_000);
    let start = Instant::now();
    while snapshot_revision(&daemon).await != with_them {
        assert!(start.elapsed() < PATIENCE, "it is never tried again");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let contents = daemon.contents("a").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("a").await, contents);
    daemon.stop().await;
}

#[tokio::test]
async fn undo_is_given_up_where_the_disk_is_scarce_and_what_cannot_be_given_up_keeps_nothing_from_going_on() {
    let reach = async |daemon: &Daemon| {
        let map = json_of(daemon.get("/v1/maps/a").await).await;
        map["storage"]["undo_from_revision"].as_u64().unwrap()
    };
    let (daemon, _) = with_dials(|_| {}).await;
    let mut data = daemon.stop().await;
    for _ in 0..3 {
        let daemon = Daemon::start_in(data, |_| {}).await;
        assert_eq!(insert(&daemon).await.status(), StatusCode::OK);
        assert_eq!(reach(&daemon).await, 1);
        data = daemon.stop().await;
    }
    let dials = Arc::new(Dials::default());
    dials.turn_disk(10_000);
    dials.turn_memory(100);
    let folder = folder_of(data.path(), "a");
    let gauges = Arc::clone(&dials) as Arc<dyn Gauges>;
    let daemon =
        Daemon::start_with_gauges_in(data, gauges, |config| config.store.snapshot_interval_s = 1).await;
    // A snapshot for undo alone that cannot be removed: it is a folder now.
    let oldest = folder.join("snapshot-00000000000000000000.mrol");
    std::fs::remove_file(&oldest).unwrap();
    std::fs::create_dir(&oldest).unwrap();
    dials.turn_disk(300);
    let start = Instant::now();
    while reach(&daemon).await == 1 {
        assert!(start.elapsed() < PATIENCE, "undo is never given up");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(oldest.exists());
    // The map goes on, and its snapshots with it.
    assert_eq!(insert_numbered(&daemon, 7).await.status(), StatusCode::OK);
    let contents = daemon.contents("a").await;
    while snapshot_revision(&daemon).await != json!(contents.0) {
        assert!(start.elapsed() < 2 * PATIENCE, "no snapshot is written any more");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    std::fs::remove_dir(&oldest).unwrap();
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("a").await, contents);
    daemon.stop().await;
}

#[tokio::test]
async fn a_server_goes_down_in_order_with_no_room_for_its_last_snapshot() {
    let (daemon, dials) = with_dials(|_| {}).await;
    let contents = daemon.contents("a").await;
    dials.turn_disk(1);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("a").await, contents);
    daemon.stop().await;
}

/// Marks half a GiB and one GiB below what is free, and a file of one and a half.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_file_that_fills_the_real_disk_refuses_changes_until_it_is_removed() {
    use rustix::fs::{FallocateFlags, fallocate, statvfs};

    let data = tempfile::tempdir().unwrap();
    let disk = statvfs(data.path()).unwrap();
    let free_mib = (disk.f_bavail * disk.f_frsize) >> 20;
    if free_mib < 4096 {
        skipped(format!("{free_mib} MiB are free, of which this test fills 1536"));
        return;
    }
    let filler = data.path().join("filler");
    let daemon = Daemon::start_in(data, |config| {
        config.limits.disk_free_low_mib = free_mib - 1024;
        config.limits.disk_free_resume_mib = free_mib - 512;
    })
    .await;
    daemon.make_map("a").await;
    assert_eq!(insert(&daemon).await.status(), StatusCode::OK);
    let file = std::fs::File::create(&filler).unwrap();
    if let Err(error) = fallocate(&file, FallocateFlags::empty(), 0, 1536 * MIB) {
        skipped(format!("the file system cannot set room aside: {error}"));
        return;
    }
    refuses_for(&daemon, &["disk_full"]).await;
    refused(insert(&daemon).await, StatusCode::INSUFFICIENT_STORAGE, "disk_full").await;
    drop(file);
    std::fs::remove_file(&filler).unwrap();
    refuses_for(&daemon, &[]).await;
    assert_eq!(insert(&daemon).await.status(), StatusCode::OK);
    daemon.stop().await;
}
