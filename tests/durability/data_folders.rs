//! What is kept, what it looks like when it cannot be, and data folders of former releases.

use std::path::Path;

use mrol::http;
use mrol::map::{MapContents, MapSettings, REVISION_MAX};
use mrol::store::{OpeningProgress, Snapshot};
use mrol::voxel::{VoxelKey, VoxelSet};
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tonic::Code;
use uuid::Uuid;

use crate::support::daemon::{Daemon, bytes_of, client, identity_json, json_of, row, scan_pb};
use crate::support::map_folders::{copy_folder, folder_of};

/// A copy of a folder under `tests/released`.
fn released(folder: &str) -> tempfile::TempDir {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/released").join(folder);
    let copy = tempfile::tempdir().unwrap();
    copy_folder(&from, copy.path());
    copy
}

pub(super) fn put_file(daemon: &Daemon, path: &str, file: Vec<u8>) -> reqwest::RequestBuilder {
    client().put(daemon.url(path)).header("content-type", "application/octet-stream").body(file)
}

#[tokio::test]
async fn a_map_whose_journal_fails_is_read_only_and_says_so() {
    let daemon = Daemon::start().await;
    daemon.make_map("well").await;
    daemon.make_map("ill").await;
    let folder = folder_of(daemon.data.path(), "ill");
    std::fs::rename(&folder, daemon.data.path().join("moved")).unwrap();

    let mut robot = daemon.mapping().await;
    // This one was handed to the journal when it failed: who knows what the disk has of it.
    let unknown = robot.insert_scan(scan_pb("ill", "r", &row(3))).await.unwrap_err();
    assert_eq!(unknown.code(), Code::Unavailable);
    assert!(unknown.message().contains("sent again then, tells"), "{unknown}");
    let refused = robot.insert_scan(scan_pb("ill", "r", &row(3))).await.unwrap_err();
    assert_eq!(refused.code(), Code::Unavailable);
    assert!(refused.message().contains("map ill is read only since its journal failed"), "{refused}");
    let refused = daemon.post("/v1/maps/ill/deletions", json!({"points": row(3)})).await;
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(json_of(refused).await["reason"], "map_read_only");

    // Nothing came of it, reading goes on, and other maps are as they were.
    assert_eq!(daemon.contents("ill").await, (0, vec![]));
    let asked = daemon.post_bytes("/v1/maps/ill/occupancy", bytes_of(&row(3))).await;
    assert_eq!(asked.status(), StatusCode::OK);
    daemon.put_in("well", &row(3)).await;
    let ready = json_of(daemon.get("/readyz").await).await;
    assert_eq!((&ready["ready"], &ready["read_only"][0]["map"]), (&json!(true), &json!("ill")));
    assert!(ready["read_only"][0]["reason"].as_str().unwrap().contains("journal-"), "{ready}");
    let metrics = daemon.get("/metrics").await.text().await.unwrap();
    for line in [
        r#"mrol_map_read_only{map="ill"} 1"#,
        r#"mrol_map_read_only{map="well"} 0"#,
        r#"mrol_map_durable_revision{map="well"} 1"#,
        r#"mrol_journal_records_total{map="well"} 1"#,
        r#"mrol_journal_sync_seconds_count{map="well"} 1"#,
    ] {
        assert!(metrics.contains(line), "{line} is not in\n{metrics}");
    }
    let map = json_of(daemon.get("/v1/maps/ill").await).await;
    assert!(map["storage"]["read_only"].is_string(), "{map}");
    daemon.stop().await;
}

#[tokio::test]
async fn a_deletion_under_an_id_is_done_once_also_across_a_restart() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(9)).await;
    let deletion = json!({"points": row(4), "request_id": "wall-7"});
    let first = json_of(daemon.post("/v1/maps/a/deletions", deletion.clone()).await).await;
    assert_eq!((&first["removed"], &first["replayed"]), (&json!(4), &json!(false)));
    daemon.put_in("a", &row(9)).await;

    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let again = json_of(daemon.post("/v1/maps/a/deletions", deletion).await).await;
    assert_eq!(again["replayed"], true);
    assert_eq!((&again["removed"], &again["revision"]), (&first["removed"], &first["revision"]));
    assert_eq!(daemon.contents("a").await.1.len(), 9);
    let other = json!({"points": row(5), "request_id": "wall-7"});
    let refused = daemon.post("/v1/maps/a/deletions", other).await;
    assert_eq!(refused.status(), StatusCode::CONFLICT);
    assert_eq!(json_of(refused).await["reason"], "request_id_taken");
    let bad = daemon.post("/v1/maps/a/deletions", json!({"points": row(5), "request_id": "a/b"})).await;
    assert_eq!(bad.status(), StatusCode::BAD_REQUEST);
}

#[tokio::test]
async fn the_same_deletion_sent_many_times_at_once_is_done_once() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(9)).await;
    let body = json!({"points": row(4), "request_id": "x"});
    let post = client().post(daemon.url("/v1/maps/a/deletions")).json(&body);
    let sent: Vec<_> = (0..16).map(|_| tokio::spawn(post.try_clone().unwrap().send())).collect();
    let mut first = 0;
    for answer in sent {
        let answer: Value = answer.await.unwrap().unwrap().json().await.unwrap();
        assert_eq!((&answer["removed"], &answer["revision"]), (&json!(4), &json!(2)));
        first += usize::from(answer["replayed"] == false);
    }
    assert_eq!(first, 1);
}

#[tokio::test]
async fn a_server_that_is_starting_says_how_far_it_is() {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let progress = OpeningProgress::default();
    tokio::spawn(async move {
        axum::serve(listener, http::starting(progress, mrol::access::Access::open())).await
    });
    let get = async |path: &str| client().get(format!("http://{address}{path}")).send().await.unwrap();
    assert_eq!(get("/livez").await.status(), StatusCode::OK);
    let ready = get("/readyz").await;
    assert_eq!(ready.status(), StatusCode::SERVICE_UNAVAILABLE);
    let expected =
        json!({"ready": false, "reason": "starting", "maps": 0, "maps_open": 0, "bytes": 0, "bytes_read": 0});
    assert_eq!(json_of(ready).await, expected);
    let refused = get("/v1/maps").await;
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(json_of(refused).await["reason"], "starting");
}

#[tokio::test]
async fn a_data_folder_of_version_1_is_opened() {
    let daemon = Daemon::start_in(released("data-1"), |_| {}).await;
    let (revision, voxels) = daemon.contents("office").await;
    assert_eq!((revision, voxels.len()), (4, 611));
    let scans = json_of(daemon.get("/v1/maps/office/trajectory").await).await;
    assert_eq!(scans["poses"].as_array().unwrap().len(), 3);
    assert_eq!(scans["poses"][2]["revision"], 3);
    assert_eq!(scans["poses"][1]["timestamp_ns"], 1001);
    daemon.put_in("office", &row(2)).await;
    let before = daemon.contents("office").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("office").await, before);
    assert!(!daemon.data.path().join("maps/office.mrol").exists());
}

/// Three scans and a deletion, a restart, two scans and an undo of the second scan, and `kill -9`.
#[tokio::test]
async fn a_data_folder_of_version_2_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-2"), |_| {}).await;
    let (revision, voxels) = daemon.contents("office").await;
    assert_eq!((revision, voxels.len()), (7, 847));
    let scans = json_of(daemon.get("/v1/maps/office/trajectory").await).await;
    let made: Vec<_> = scans["poses"].as_array().unwrap().iter().map(|pose| &pose["revision"]).collect();
    assert_eq!(made, [1, 3, 5, 6]);
    let undo = json!({"revision": 2, "request_id": "u-2"});
    let again = json_of(daemon.post("/v1/maps/office/undo", undo).await).await;
    assert_eq!((&again["replayed"], &again["removed"]), (&json!(true), &json!(212)));
    // VoxelOwnership reach back to the first scan.
    let undone = json_of(daemon.post("/v1/maps/office/undo", json!({"revision": 1})).await).await;
    assert_eq!(undone["scans"], 1);
}

/// The same, of map files of version 3 and journals of version 2: moments have forms there.
#[tokio::test]
async fn a_data_folder_of_version_3_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-3"), |_| {}).await;
    let (revision, voxels) = daemon.contents("office").await;
    assert_eq!((revision, voxels.len()), (7, 1072));
    let scans = json_of(daemon.get("/v1/maps/office/trajectory").await).await;
    let made: Vec<_> = scans["poses"].as_array().unwrap().iter().map(|pose| &pose["revision"]).collect();
    assert_eq!(made, [1, 3, 5, 6]);
    let undo = json!({"revision": 2, "request_id": "u-2"});
    let again = json_of(daemon.post("/v1/maps/office/undo", undo).await).await;
    assert_eq!((&again["replayed"], &again["removed"]), (&json!(true), &json!(216)));
    let undone = json_of(daemon.post("/v1/maps/office/undo", json!({"revision": 1})).await).await;
    assert_eq!(undone["scans"], 1);
}

/// The same, of map files of version 4 and journals of version 3: scans have no session there.
#[tokio::test]
async fn a_data_folder_of_version_4_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-4"), |_| {}).await;
    let (revision, voxels) = daemon.contents("office").await;
    assert_eq!((revision, voxels.len()), (7, 567));
    let scans = json_of(daemon.get("/v1/maps/office/trajectory").await).await;
    let made: Vec<_> = scans["poses"].as_array().unwrap().iter().map(|pose| &pose["revision"]).collect();
    assert_eq!(made, [1, 3, 5, 6]);
    assert_eq!(scans["poses"][3]["session"], "");
    let undo = json!({"revision": 2, "request_id": "u-2"});
    let again = json_of(daemon.post("/v1/maps/office/undo", undo).await).await;
    assert_eq!((&again["replayed"], &again["removed"]), (&json!(true), &json!(91)));
    let undone =
        json_of(daemon.post("/v1/maps/office/undo", json!({"robot": "r1", "scan_id": 0})).await).await;
    assert_eq!(undone["scans"], 1);
    let before = daemon.contents("office").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("office").await, before);
}

/// The same, of map files of version 5 and journals of version 4: no undo put voxels back there.
#[tokio::test]
async fn a_data_folder_of_version_5_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-5"), |_| {}).await;
    let office = json_of(daemon.get("/v1/maps/office").await).await;
    assert_eq!((&office["revision"], &office["content_hash"]), (&json!(7), &json!("510fcafce6989f8b")));
    let again = json!({"revision": 2, "request_id": "u-2"});
    let again = json_of(daemon.post("/v1/maps/office/undo", again).await).await;
    assert_eq!(
        (&again["replayed"], &again["removed"], &again["restored"]),
        (&json!(true), &json!(77), &json!(0))
    );
    // Of the 34 voxels that went, the undone scan alone had held some.
    let undone = json_of(daemon.post("/v1/maps/office/undo", json!({"revision": 4})).await).await;
    assert_eq!((&undone["deletions"], &undone["removed"]), (&json!(1), &json!(0)));
    assert!((1..34).contains(&undone["restored"].as_u64().unwrap()), "{undone}");
    let before = daemon.contents("office").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("office").await, before);
}

/// The same, of map files of version 6 and journals of version 5, with the undo of a deletion: there were no keep-outs.
#[tokio::test]
async fn a_data_folder_of_version_6_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-6"), |_| {}).await;
    let office = json_of(daemon.get("/v1/maps/office").await).await;
    assert_eq!((&office["revision"], &office["content_hash"]), (&json!(8), &json!("c229d97eea012c0c")));
    for (body, removed, restored) in [
        (json!({"revision": 2, "request_id": "u-2"}), 44, 0),
        (json!({"revision": 4, "request_id": "u-4"}), 0, 8),
    ] {
        let again = json_of(daemon.post("/v1/maps/office/undo", body).await).await;
        assert_eq!((&again["replayed"], &again["removed"]), (&json!(true), &json!(removed)));
        assert_eq!(again["restored"], restored);
    }
    let keep_outs = json_of(daemon.get("/v1/maps/office/keep-outs").await).await;
    assert_eq!(keep_outs["keep_outs"], json!([]));
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    let put = daemon.put("/v1/maps/office/keep-outs/dock", sphere).await;
    assert_eq!(json_of(put).await["revision"], 9);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let office = json_of(daemon.get("/v1/maps/office").await).await;
    assert_eq!((&office["revision"], &office["content_hash"]), (&json!(9), &json!("c229d97eea012c0c")));
    let keep_outs = json_of(daemon.get("/v1/maps/office/keep-outs").await).await;
    assert_eq!(keep_outs["keep_outs"][0]["made_revision"], 9);
}

/// The same, of map files of version 7 and journals of version 6, with keep-outs: no scan left a viewpoint.
#[tokio::test]
async fn a_data_folder_of_version_7_is_opened_with_its_journal() {
    let daemon = Daemon::start_in(released("data-7"), |_| {}).await;
    let office = json_of(daemon.get("/v1/maps/office").await).await;
    assert_eq!((&office["revision"], &office["content_hash"]), (&json!(8), &json!("27e773a0ac1c1467")));
    let keep_outs = json_of(daemon.get("/v1/maps/office/keep-outs").await).await;
    let made: Vec<_> =
        keep_outs["keep_outs"].as_array().unwrap().iter().map(|it| &it["made_revision"]).collect();
    assert_eq!(made, [3, 7]);
    let undone = json_of(daemon.post("/v1/maps/office/undo", json!({"revision": 8})).await).await;
    assert_eq!((&undone["deletions"], &undone["restored"]), (&json!(1), &json!(29)));
    let before = daemon.contents("office").await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents("office").await, before);
}

#[tokio::test]
async fn a_damaged_snapshot_is_set_aside_and_goes_with_those_of_its_age() {
    let daemon = Daemon::start_with(|config| config.store.undo_revisions = 1).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(2)).await;
    let mut data = daemon.stop().await;
    let newest = folder_of(data.path(), "a").join("snapshot-00000000000000000001.mrol");
    let mut bytes = std::fs::read(&newest).unwrap();
    bytes[60] ^= 1;
    std::fs::write(&newest, &bytes).unwrap();
    let mut there = Vec::new();
    for points in 3..6 {
        let daemon = Daemon::start_in(data, |config| config.store.undo_revisions = 1).await;
        daemon.put_in("a", &row(points)).await;
        assert_eq!(daemon.contents("a").await.1.len(), points);
        data = daemon.stop().await;
        there.push(newest.with_extension("mrol.damaged").exists());
    }
    assert_eq!(there, [true, false, false]);
}

#[tokio::test]
async fn one_damaged_map_keeps_no_other_from_being_served() {
    let daemon = Daemon::start().await;
    for map in ["well", "ill"] {
        daemon.make_map(map).await;
        daemon.put_in(map, &row(3)).await;
    }
    let data = daemon.stop().await;
    for entry in std::fs::read_dir(folder_of(data.path(), "ill")).unwrap() {
        std::fs::write(entry.unwrap().path(), b"no map any more").unwrap();
    }
    let daemon = Daemon::start_in(data, |_| {}).await;
    assert_eq!(daemon.contents("well").await.1.len(), 3);
    daemon.put_in("well", &row(5)).await;
    let listed = json_of(daemon.get("/v1/maps").await).await;
    assert_eq!(listed["maps"].as_array().unwrap().len(), 1);
    assert_eq!(listed["unavailable"][0]["map"], "ill");
    let ready = json_of(daemon.get("/readyz").await).await;
    assert_eq!((&ready["ready"], &ready["unavailable"][0]["map"]), (&json!(true), &json!("ill")));
    assert!(ready["unavailable"][0]["reason"].as_str().unwrap().contains("snapshot-"), "{ready}");
    let metrics = daemon.get("/metrics").await.text().await.unwrap();
    assert!(metrics.contains(r#"mrol_map_unavailable{map="ill"} 1"#), "{metrics}");
    let grpc = daemon.maps().await.list_maps(pb::ListMapsRequest {}).await.unwrap().into_inner();
    assert_eq!((grpc.maps.len(), &*grpc.unavailable[0].map), (1, "ill"));
    let create = client().put(daemon.url("/v1/maps/ill")).json(&json!({"resolution_m": 0.1}));
    for refused in [
        daemon.get("/v1/maps/ill").await,
        daemon.post("/v1/maps/ill/deletions", json!({"points": row(3)})).await,
        create.send().await.unwrap(),
        client().delete(daemon.url("/v1/maps/ill")).send().await.unwrap(),
    ] {
        assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
        assert_eq!(json_of(refused).await["reason"], "map_unavailable");
    }
}

#[tokio::test]
async fn a_map_is_replaced_and_the_one_that_was_there_is_kept() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    daemon.put_in("a", &row(7)).await;
    let put = async |daemon: &Daemon, path: &str| put_file(daemon, path, file.to_vec()).send().await.unwrap();
    let refused = put(&daemon, "/v1/maps/a/snapshot").await;
    assert_eq!(json_of(refused).await["reason"], "map_exists");
    assert_eq!(put(&daemon, "/v1/maps/a/snapshot?replace=true").await.status(), StatusCode::CREATED);
    let are_both_there = async |daemon: &Daemon| {
        assert_eq!(
            (daemon.contents("a").await.1.len(), daemon.contents("a-replaced-2").await.1.len()),
            (3, 7)
        );
    };
    are_both_there(&daemon).await;
    daemon.put_in("a-replaced-2", &row(7)).await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    are_both_there(&daemon).await;
    assert_eq!(daemon.contents("a-replaced-2").await.0, 3);
    // In memory as well, and where there was none.
    let daemon = Daemon::start_with(|config| config.data_dir = "".into()).await;
    for map in ["a", "a-replaced-1"] {
        assert_eq!(put(&daemon, "/v1/maps/a/snapshot?replace=true").await.status(), StatusCode::CREATED);
        assert_eq!(daemon.contents(map).await.1.len(), 3);
    }
}

#[tokio::test]
async fn the_last_revision_is_refused_and_so_is_what_would_come_after_it() {
    let daemon = Daemon::start().await;
    let voxels = [VoxelKey::new([1, 2, 3]).unwrap()].into_iter().collect();
    let at = |revision| {
        let contents = MapContents::at(revision, VoxelSet::clone(&voxels));
        let snapshot = Snapshot { uuid: Uuid::new_v4(), settings: MapSettings::new(0.1, 3), contents };
        put_file(&daemon, &format!("/v1/maps/m{revision}/snapshot"), snapshot.encode().unwrap())
    };
    let refused = at(REVISION_MAX + 1).send().await.unwrap();
    assert_eq!(refused.status(), StatusCode::BAD_REQUEST);
    assert!(json_of(refused).await["detail"].as_str().unwrap().contains("9007199254740992"));
    assert_eq!(at(REVISION_MAX - 1).send().await.unwrap().status(), StatusCode::CREATED);
    let map = format!("m{}", REVISION_MAX - 1);
    daemon.put_in(&map, &row(3)).await;
    let scan = json!({"robot": "r", "points": row(5), "guess": identity_json(), "align": false});
    let refused = daemon.post(&format!("/v1/maps/{map}/scans"), scan).await;
    assert_eq!(json_of(refused).await["reason"], "revisions_used_up");
    let before = daemon.contents(&map).await;
    assert_eq!(before.0, REVISION_MAX);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(daemon.contents(&map).await, before, "the last acknowledged scan is lost");
}

#[tokio::test]
async fn a_map_file_that_could_not_be_restored_is_not_handed_out() {
    let daemon = Daemon::start_with(|config| {
        config.limits.map_file_bytes_max = 300;
        config.limits.viewpoint_bytes_max = 0;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(2)).await;
    assert_eq!(daemon.get("/v1/maps/a/snapshot").await.status(), StatusCode::OK);
    let far: Vec<[f32; 3]> = (0..300).map(|i| [i as f32, 0.0, 0.0]).collect();
    daemon.put_in("a", &far).await;
    let refused = daemon.get("/v1/maps/a/snapshot").await;
    let error = json_of(refused).await;
    assert_eq!(error["reason"], "map_file_too_large", "{error}");
    assert!(error["detail"].as_str().unwrap().contains("map_file_bytes_max is 300"), "{error}");
}

#[cfg(unix)]
#[tokio::test]
async fn nobody_else_reads_the_data_folder_unless_the_settings_say_so() {
    use std::os::unix::fs::PermissionsExt;
    for (mode, folders, files) in [("0700", 0o700, 0o600), ("0750", 0o750, 0o640)] {
        let data = tempfile::tempdir().unwrap();
        let daemon = Daemon::start_with(|config| {
            config.data_dir = data.path().join("data");
            config.store.mode = mode.parse().unwrap();
        })
        .await;
        daemon.make_map("a").await;
        daemon.put_in("a", &row(2)).await;
        let bits = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        // The process may take bits away, and never adds any.
        let folder = folder_of(&data.path().join("data"), "a");
        for folder in [&data.path().join("data"), &folder] {
            assert_eq!(bits(folder) & !folders, 0, "{folder:?}: {:o}", bits(folder));
        }
        for file in std::fs::read_dir(&folder).unwrap() {
            let file = file.unwrap().path();
            assert_eq!(bits(&file) & !files, 0, "{file:?}: {:o}", bits(&file));
        }
        daemon.stop().await;
    }
}
