//! `mrol export` of recordings, and grids of map files: what is looked at without a server.

use std::path::Path;

use serde_json::Value;

use super::{complaint, mrol, objects};

const FIXTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/logs/tests/fixtures/zstd.mcap");

/// A map of a log, in a folder of its own.
fn map_of_a_log() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("ride.mrol").to_str().unwrap().to_owned();
    let scans = objects(&["map", FIXTURE, "--resolution", "0.1", "--levels", "5", "--out", &map]);
    assert!(scans.iter().any(|scan| scan["accepted"] == true), "{scans:?}");
    (folder, map)
}

#[test]
fn a_map_is_recorded_for_viewers_of_logs_and_read_as_any_log() {
    let (folder, map) = map_of_a_log();
    let out = folder.path().join("ride.mcap").to_str().unwrap().to_owned();
    let told = &objects(&["export", &map, "--out", &out, "--band", "-100 100"])[0];
    let lines = objects(&["log", &out]);
    let topic = |name: &str| -> Value {
        lines.iter().find(|line| line["topic"] == name).unwrap_or_else(|| panic!("{name}: {lines:?}")).clone()
    };
    assert_eq!(topic("/map/voxels")["type"], "sensor_msgs/msg/PointCloud2");
    assert_eq!(topic("/robots/mrol/path")["type"], "nav_msgs/msg/Path");
    assert!(topic("/tf")["messages"].as_u64() >= Some(1), "{lines:?}");
    assert!(told["points"].as_u64() > Some(20), "{told}");
    // What it records is the map: a scan of it, at the origin, has the same voxels.
    let again = objects(&["map", &out, "--resolution", "0.1", "--levels", "5"]);
    assert_eq!(again[0]["new_voxels"], told["points"], "{again:?}");
}

#[test]
fn a_map_file_is_drawn_as_a_server_draws_it() {
    let (folder, map) = map_of_a_log();
    let server = crate::support::process::Process::start("", &[]);
    let call = mrol(&["restore", &map, "--map", "a", "--server", &server.grpc]).output().unwrap();
    assert!(call.status.success(), "{}", String::from_utf8_lossy(&call.stderr));
    let draw = |name: &str, of: &[&str]| -> (Value, Vec<u8>) {
        let image = folder.path().join(name);
        let drawn = [
            "grid",
            "--out",
            image.to_str().unwrap(),
            "--band",
            "-100 100",
            "--band-from",
            "map",
            "--unknown",
        ];
        let drawn = objects(&[&drawn[..], of].concat());
        (drawn[0].clone(), std::fs::read(Path::new(&image)).unwrap())
    };
    let (here, image_here) = draw("here.pgm", &[&map]);
    let (there, image_there) = draw("there.pgm", &["--map", "a", "--server", &server.grpc]);
    assert!(image_here == image_there && here["cells_free"].as_u64() > Some(0), "{here} {there}");
    for field in ["size", "origin_m", "cells_occupied", "cells_free", "revision"] {
        assert_eq!(here[field], there[field], "{field}");
    }
    let out = folder.path().join("x.pgm").to_str().unwrap().to_owned();
    let refused = |more: &[&str], code: i32| complaint(&[&["grid", "--out", &out], more].concat(), code);
    assert!(refused(&[&map, "--level", "9"], 2).contains("--level must be 0 to 4"));
    assert!(refused(&[&map, "--min-revision", "1000000"], 1).contains("before --min-revision"));
    assert!(refused(&[&map, "--map", "a"], 2).contains("cannot be used with"));
    assert!(refused(&[], 2).contains("FILE.mrol"));
    assert_eq!(server.stop(), Some(0));
}
