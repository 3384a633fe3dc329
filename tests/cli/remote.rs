//! `mrol serve`, and what is done with it: maps, insert, query, delete.

use mrol::geometry::Point;
use mrol::scan::write_f32;
use serde_json::{Value, json};

use super::{Sequence, complaint, mrol, objects};
use crate::support::process::Process;

/// A daemon in a process of its own, which is called.
struct Daemon(Process);

impl Daemon {
    fn start(data_dir: &str) -> Self {
        Self(Process::start(data_dir, &[]))
    }

    /// The objects that a call to it prints.
    fn call(&self, arguments: &[&str]) -> Vec<Value> {
        objects(&[arguments, &["--server", &self.0.grpc]].concat())
    }

    /// What a call to it complains about.
    fn refuses(&self, arguments: &[&str]) -> String {
        complaint(&[arguments, &["--server", &self.0.grpc]].concat(), 1)
    }

    fn stop(self) -> Option<i32> {
        self.0.stop()
    }
}

#[test]
fn a_map_is_made_listed_described_and_deleted() {
    let daemon = Daemon::start("");
    assert!(daemon.call(&["maps", "list"]).is_empty());
    let create = ["maps", "create", "a", "--resolution", "0.05", "--levels", "3", "--filter-hashes", "3"];
    let made = &daemon.call(&create)[0];
    assert_eq!((&made["created"], &made["map"]), (&json!(true), &json!("a")));
    assert_eq!(made["settings"]["filter"]["hashes"], 3);
    assert_eq!(daemon.call(&create)[0]["created"], false);
    let again = mrol(&[&create[..], &["--server", &daemon.0.grpc]].concat()).assert().success();
    let line = String::from_utf8(again.get_output().stdout.clone()).unwrap();
    assert!(line.starts_with("map a was there already: voxels of 0.05 m, 3 levels, uuid "), "{line}");
    assert_eq!(line.lines().count(), 1, "{line}");
    assert!(daemon.refuses(&["maps", "create", "a", "--resolution", "0.1"]).contains("map_exists"));
    assert_eq!(daemon.call(&["maps", "list"])[0]["map_uuid"], made["map_uuid"]);
    assert_eq!(daemon.call(&["maps", "show", "a"])[0]["levels"].as_array().unwrap().len(), 3);
    let renamed = &daemon.call(&["maps", "rename", "a", "b"])[0];
    assert_eq!((&renamed["renamed"], &renamed["map"]), (&json!("a"), &json!("b")));
    assert_eq!(renamed["map_uuid"], made["map_uuid"]);
    assert!(daemon.refuses(&["maps", "rename", "a", "c"]).contains("map a does not exist"));
    assert!(daemon.refuses(&["maps", "rename", "b", "b"]).contains("map_exists"));
    let back = mrol(&["maps", "rename", "b", "a", "--server", &daemon.0.grpc]).assert().success();
    let line = String::from_utf8(back.get_output().stdout.clone()).unwrap();
    assert!(line.starts_with("map b is called a now: voxels of 0.05 m, 3 levels, uuid "), "{line}");
    // Without a terminal nobody is asked.
    assert_eq!(daemon.call(&["maps", "delete", "a"]), [json!({"deleted": "a"})]);
    daemon.call(&["maps", "create", "a", "--resolution", "0.1"]);
    assert_eq!(daemon.call(&["maps", "delete", "a", "--yes"]), [json!({"deleted": "a"})]);
    assert!(daemon.refuses(&["maps", "show", "a"]).contains("map a does not exist"));
    assert_eq!(daemon.stop(), Some(0));
}

#[test]
fn a_sequence_sent_to_a_daemon_gives_the_poses_of_one_mapped_here() {
    let sequence = Sequence::of(3);
    let (scans, pose) = (sequence.path("scans"), sequence.first_pose());
    let settings = ["--resolution", "0.05", "--levels", "5"];
    let here = objects(&[&["map", &scans, "--first-pose", &pose], &settings[..]].concat());

    let daemon = Daemon::start("");
    let insert = ["insert", &scans, "--map", "a", "--guess", &pose, "--first-scan-id", "0"];
    let there = daemon.call(&[&insert[..], &["--create"], &settings].concat());
    for (here, there) in here.iter().zip(&there) {
        for field in ["scan", "verdict", "map_from_sensor", "overlap", "new_voxels"] {
            assert_eq!(here[field], there[field]);
        }
    }
    assert_eq!((there.len(), &there[2]["revision"]), (3, &json!(3)));
    let again = daemon.call(&insert);
    assert!(again.iter().all(|line| line["replayed"] == true), "{again:?}");
    assert!(daemon.refuses(&["insert", &scans, "--map", "a", "--robot", "b"]).contains("--guess says where"));
    assert!(daemon.refuses(&["insert", &scans, "--map", "b"]).contains("--create"));
}

#[test]
fn an_insertion_ends_with_a_code_of_its_own_where_a_scan_is_refused() {
    let sequence = Sequence::of(2);
    let (scans, away) = (sequence.path("scans"), "50 50 0 0 0 0 1");
    let daemon = Daemon::start("");
    daemon.call(&["insert", &scans, "--map", "a", "--create", "--resolution", "0.1"]);

    let first = sequence.path("scans/0000.ply");
    let insert = ["insert", &first, "--map", "a", "--guess", away, "--server", &daemon.0.grpc, "--json"];
    let output = mrol(&insert).assert().code(3).get_output().clone();
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&answer["accepted"], &answer["verdict"]), (&json!(false), &json!("low_overlap")));
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "error: 1 of 1 scans not accepted\n");
    assert_eq!(daemon.call(&[&insert[..6], &["--force"]].concat())[0]["accepted"], true);

    // Each event names what an undo of it takes.
    let events = mrol(&["events", "--map", "a", "--server", &daemon.0.grpc]).assert().success();
    let told = String::from_utf8(events.get_output().stdout.clone()).unwrap();
    let first = told.lines().next().unwrap();
    assert!(first.contains(" scan 0 of session ") && first.contains(" new voxels, revision 1, "), "{told}");
}

#[test]
fn what_was_inserted_is_found_and_what_was_deleted_is_not() {
    let sequence = Sequence::of(2);
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let points = "1 1 1\n-1 2 0.5\n1.02 1 1\n";
    let (file, bitmap) = (sequence.path("points.xyz"), sequence.path("bitmap"));
    std::fs::write(&file, points).unwrap();

    let daemon = Daemon::start("");
    daemon.call(&["insert", &scans, "--map", "a", "--truth", &truth, "--create", "--resolution", "0.1"]);
    daemon.call(&["insert", &file, "--map", "b", "--create", "--resolution", "0.1"]);
    let asked = &daemon.call(&["query", &file, "--map", "b", "--out", &bitmap])[0];
    assert_eq!((&asked["points"], &asked["occupied"]), (&json!(3), &json!(3)));
    assert_eq!(std::fs::read(&bitmap).unwrap(), [0b111]);

    let of_points = |points: &[&str]| {
        let options: Vec<_> = points.iter().flat_map(|point| ["--point", point]).collect();
        let lines = daemon.call(&[&["query", "--map", "b"], &options[..]].concat());
        lines.iter().map(|line| line["occupied"].as_bool().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(of_points(&["1.01,1,1", "-1,2,0.5", "-1,2,0.7"]), [true, true, false]);
    let block = daemon.call(&["block", "--map", "b"]);
    assert_eq!((&block[0]["voxels"], &block[0]["blocks"]), (&json!(2), &json!(2)));
    let distances = sequence.path("distances");
    let dense = ["block", "--map", "b", "--box", "0.9 1 1 1.2 1.1 1.1", "--dense", "--out", &distances];
    let dense = &daemon.call(&dense)[0];
    assert_eq!((&dense["origin"], &dense["size"]), (&json!([9, 10, 10]), &json!([3, 1, 1])));
    assert_eq!(std::fs::read(&distances).unwrap(), [2, 0, 2]);
    let refused = daemon.refuses(&["observers", "--map", "b", "--point", "1.01,1,1"]);
    assert!(refused.contains("kept in memory only"), "{refused}");
    assert_eq!(daemon.call(&["delete", "--map", "b", "--box", "-2 0 0 0 3 1"])[0]["removed"], 1);
    assert_eq!(of_points(&["1,1,1", "-1,2,0.5"]), [true, false]);
    assert_eq!(daemon.call(&["delete", "--map", "b", "--points", &file])[0]["removed"], 1);
    assert_eq!(of_points(&["1,1,1"]), [false]);
    // What f32 holds too coarsely is refused before the server is asked.
    assert!(daemon.refuses(&["query", "--map", "b", "--point", "1e9,0,0"]).contains("--origin"));
    assert!(daemon.refuses(&["query", "--map", "b", "--point", "0,0,0", "--level", "6"]).contains("level"));
}

#[test]
fn maps_survive_a_restart_and_one_made_without_a_daemon_is_served() {
    let sequence = Sequence::of(2);
    let (scans, data) = (sequence.path("scans"), sequence.path("data"));
    let daemon = Daemon::start(&data);
    daemon.call(&["insert", &scans, "--map", "a", "--create", "--resolution", "0.1"]);
    let before = daemon.call(&["maps", "show", "a"]);
    assert_eq!(daemon.stop(), Some(0));

    objects(&["map", &scans, "--resolution", "0.1", "--out", &sequence.path("data/maps/here.mrol")]);
    let daemon = Daemon::start(&data);
    let after = daemon.call(&["maps", "show", "a"]);
    assert_eq!(after[0]["map_uuid"], before[0]["map_uuid"]);
    let voxels = |map: &Value| map["levels"][0]["voxels"].as_u64().unwrap();
    assert_eq!(voxels(&after[0]), voxels(&before[0]));
    assert_eq!(voxels(&daemon.call(&["maps", "show", "here"])[0]), voxels(&before[0]));
}

#[test]
fn the_address_of_the_other_protocol_is_recognised_as_such() {
    let daemon = Daemon::start("");
    let said = complaint(&["maps", "list", "--server", &daemon.0.http], 1);
    assert!(said.contains("is that the gRPC address"), "{said}");
}

#[test]
fn the_server_may_come_from_the_environment_and_people_get_tables() {
    let daemon = Daemon::start("");
    daemon.call(&["maps", "create", "a", "--resolution", "0.25"]);
    let list =
        mrol(&["maps", "list"]).env("MROL_SERVER", &daemon.0.grpc).assert().success().get_output().clone();
    let list = String::from_utf8(list.stdout).unwrap();
    assert!(list.starts_with("a ") && list.contains("0.25 m"), "{list}");
}

#[test]
fn maps_are_backed_up_and_brought_back_elsewhere() {
    let sequence = Sequence::of(2);
    let (scans, backup) = (sequence.path("scans"), sequence.path("backup"));
    let daemon = Daemon::start(&sequence.path("data"));
    daemon.call(&["insert", &scans, "--map", "a", "--create", "--resolution", "0.1"]);
    daemon.call(&["maps", "create", "b", "--resolution", "0.5"]);
    let saved = daemon.call(&["snapshot", &backup]);
    assert_eq!((saved.len(), &saved[0]["map"], &saved[0]["revision"]), (2, &json!("a"), &json!(2)));
    let before = &daemon.call(&["maps", "show", "a"])[0];

    let other = Daemon::start(&sequence.path("elsewhere"));
    let (a, b) = (format!("{backup}/a.mrol"), format!("{backup}/b.mrol"));
    let restored = other.call(&["restore", &a, &b]);
    assert_eq!(restored[0], json!({"map": "a", "revision": 2, "voxels": saved[0]["voxels"]}));
    assert!(other.refuses(&["restore", &a]).contains("map a exists"));
    other.call(&["restore", &a, "--map", "before"]);
    let after = &other.call(&["maps", "show", "before"])[0];
    assert_ne!(after["map_uuid"], before["map_uuid"]);
    assert_eq!((&after["levels"][3]["voxels"], &after["scans"]), (&before["levels"][3]["voxels"], &json!(2)));
    // It goes on from there, and is as durable as any.
    other.call(&[
        "insert",
        &scans,
        "--map",
        "before",
        "--robot",
        "r2",
        "--truth",
        &sequence.path("poses.txt"),
    ]);
    assert_eq!(other.stop(), Some(0));
    let other = Daemon::start(&sequence.path("elsewhere"));
    assert_eq!(other.call(&["maps", "show", "before"])[0]["revision"], 4);

    let broken = sequence.path("broken.mrol");
    let mut bytes = std::fs::read(&a).unwrap();
    bytes[40] ^= 1;
    std::fs::write(&broken, bytes).unwrap();
    assert!(other.refuses(&["restore", &broken]).contains("bad_map_file"));
    assert!(other.refuses(&["restore", &scans]).contains("scans"));
    let names = other.call(&["maps", "list"]);
    assert_eq!(names.len(), 3);
}

#[test]
fn the_settings_that_count_are_printed_and_read_back() {
    let sequence = Sequence::of(1);
    let printed = mrol(&["config", "print", "--durability", "250ms"])
        .env("MROL_LIMITS__MAPS_MAX", "4")
        .assert()
        .success()
        .get_output()
        .clone();
    let file = sequence.path("mrol.toml");
    std::fs::write(&file, &printed.stdout).unwrap();
    let read = &objects(&["config", "print", "--config", &file])[0];
    assert_eq!((&read["store"]["durability"], &read["limits"]["maps_max"]), (&json!("250ms"), &json!(4)));
    assert_eq!(read["http"]["listen"], "127.0.0.1:7333");
    assert!(complaint(&["config", "print", "--durability", "often"], 2).contains("durability"));
}

#[test]
fn a_keep_out_is_put_asked_about_listed_and_removed() {
    let daemon = Daemon::start("");
    daemon.call(&["maps", "create", "a", "--resolution", "0.1"]);
    let made = &daemon.call(&["keepout", "put", "dock", "--map", "a", "--box", "0 0 0 1 1 1"])[0];
    assert_eq!((&made["keep_out"], &made["revision"]), (&json!("dock"), &json!(1)));
    let prism = ["--prism", "0 0 4 0 4 3", "--height", "-1 2.5", "--expires-in", "2d"];
    daemon.call(&[&["keepout", "put", "stage", "--map", "a"], &prism[..]].concat());
    let all = daemon.call(&["keepout", "list", "--map", "a"]);
    assert_eq!(
        all[0],
        json!({"name": "dock", "box": {"min_m": [0.0, 0.0, 0.0], "max_m": [1.0, 1.0, 1.0]}, "made_revision": 1})
    );
    assert_eq!((&all[1]["name"], &all[1]["prism"]["z_to_m"]), (&json!("stage"), &json!(2.5)));
    assert!(all[1]["expires_at_ns"].is_i64(), "{all:?}");
    let query = ["query", "--map", "a", "--point", "0.5,0.5,0.5"];
    assert_eq!(daemon.call(&query)[0]["occupied"], false);
    assert_eq!(daemon.call(&[&query[..], &["--keep-out"]].concat())[0]["occupied"], true);
    assert_eq!(daemon.call(&["keepout", "delete", "dock", "--map", "a"])[0]["revision"], 3);
    assert!(daemon.refuses(&["keepout", "delete", "dock", "--map", "a"]).contains("has no keep-out dock"));
    mrol(&["keepout", "put", "x", "--map", "a"]).assert().code(2);
    mrol(&["keepout", "put", "x", "--map", "a", "--prism", "0 0 1 0 1 1"]).assert().code(2);
    mrol(&["keepout", "put", "x", "--map", "a", "--prism", "0 0 1 1 2 2", "--height", "0 1"])
        .assert()
        .code(2);
}

#[test]
fn a_map_is_exported_as_points_that_are_read_back_the_same_from_a_file_and_a_server() {
    let sequence = Sequence::of(1);
    let path = |name: &str| sequence.path(name);
    let (scans, map) = (path("scans"), path("a.mrol"));
    objects(&["map", &scans, "--resolution", "0.1", "--out", &map]);
    let daemon = Daemon::start("");
    daemon.call(&["restore", &map]);
    let settings = mrol::store::Snapshot::read(&mrol::store::Disk::default(), map.as_ref()).unwrap();
    for level in [0_u32, 2] {
        let level_text = level.to_string();
        let side = 0.1 * f64::from(1 << level);
        let expected: std::collections::BTreeSet<_> =
            settings.contents.voxels.iter().map(|key| key.ancestor(level).index()).collect();
        for out in [path("a.ply"), path("a.pcd")] {
            let told = &objects(&["export", &map, "--level", &level_text, "--out", &out])[0];
            assert_eq!(told["points"], expected.len());
            let bytes = std::fs::read(&out).unwrap();
            let points = mrol::scan::read_points(out.as_ref()).unwrap();
            let index = |c: f64| (c / side).floor() as i32;
            let found: std::collections::BTreeSet<[i32; 3]> =
                points.iter().map(|point| point.to_f64().coords.map(index).into()).collect();
            assert!(points.len() == expected.len() && found == expected, "level {level} of {out}");
            daemon.call(&["export", "--map", "a", "--level", &level_text, "--out", &out]);
            assert!(std::fs::read(&out).unwrap() == bytes, "level {level} of {out}");
        }
    }
    let refused = |level: &str, out: &str| complaint(&["export", &map, "--level", level, "--out", out], 2);
    assert!(refused("6", &path("b.ply")).contains("--level must be 0 to 5, got 6"));
    assert!(refused("0", &path("b.obj")).contains("--out must end in one of .ply .pcd .bt .ot .npz"));
}

#[test]
fn an_undo_of_a_robot_that_the_map_does_not_know_names_those_that_it_knows() {
    let sequence = Sequence::of(1);
    let scans = sequence.path("scans");
    let daemon = Daemon::start(&sequence.path("data"));
    let create = ["--create", "--resolution", "0.1"];
    daemon.call(&[&["insert", &scans, "--map", "a", "--robot", "r1"], &create[..]].concat());
    let refused = daemon.refuses(&["undo", "--map", "a", "--robot", "r2", "--since", "0"]);
    assert!(refused.contains("map a knows no robot r2: it has scans of r1"), "{refused}");
    let undo = ["undo", "--map", "a", "--robot", "r1", "--since", "0"];
    assert_eq!(daemon.call(&undo)[0]["scans"], 1);
    // The robot stays known, and nothing is left to undo.
    assert_eq!(daemon.call(&undo)[0]["scans"], 0);
}

#[test]
fn a_scan_that_is_larger_than_a_message_may_be_is_refused_by_name() {
    let server = Process::start("", &[]);
    let folder = tempfile::tempdir().unwrap();
    let scan = folder.path().join("scan.f32");
    // A surface: 34 MB.
    let points = (0..2_900_000).map(|k| Point::new((k % 1700) as f32 * 0.01, (k / 1700) as f32 * 0.01, 2.0));
    write_f32(&scan, &points.collect::<Vec<_>>()).unwrap();
    objects(&["maps", "create", "a", "--resolution", "0.1", "--server", &server.grpc]);
    let sent =
        mrol(&["insert", scan.to_str().unwrap(), "--map", "a", "--server", &server.grpc]).output().unwrap();
    let said = [sent.stdout, sent.stderr].map(|said| String::from_utf8(said).unwrap()).concat();
    assert!(!sent.status.success() && said.contains("message_bytes_max is 33554432"), "{said}");
    assert!(!said.contains("lost the connection"), "{said}");
}
