//! `mrol check`, `rays`, `nearest` and `grid`: what planners ask, among voxels and keep-outs.

use serde_json::{Value, json};

use super::{complaint, mrol, number, objects};
use crate::support::process::Process;

/// A daemon with a wall at x = 1.0 to 1.1, and a keep-out of 0.3 m around (0, 1, 0).
struct Building {
    daemon: Process,
    _scan: tempfile::TempDir,
}

impl Building {
    fn open() -> Self {
        let (daemon, folder) = (Process::start("", &[]), tempfile::tempdir().unwrap());
        let file = folder.path().join("0000.xyz");
        let row = |y: i32| {
            (-20..20)
                .map(move |z| format!("1.05 {} {}\n", f64::from(y) / 10.0 + 0.05, f64::from(z) / 10.0 + 0.05))
        };
        std::fs::write(&file, (-20..20).flat_map(row).collect::<String>()).unwrap();
        let building = Self { daemon, _scan: folder };
        let file = file.to_str().unwrap();
        let insert = ["insert", file, "--create", "--resolution", "0.1", "--guess", "0 0 0 0 0 0 1"];
        assert_eq!(building.ask(&insert)[0]["accepted"], true);
        building.ask(&["keepout", "put", "dock", "--sphere", "0 1 0 0.3"]);
        building
    }

    fn ask(&self, arguments: &[&str]) -> Vec<Value> {
        objects(&[arguments, &["--map", "a", "--server", &self.daemon.grpc]].concat())
    }

    fn says(&self, arguments: &[&str]) -> String {
        let arguments = [arguments, &["--map", "a", "--server", &self.daemon.grpc]].concat();
        String::from_utf8(mrol(&arguments).assert().success().get_output().stdout.clone()).unwrap()
    }
}

const BALL: [&str; 3] = ["check", "--sphere", "0 0 0 0.2"];

#[test]
fn a_body_is_checked_at_poses_and_along_a_motion() {
    let building = Building::open();
    let poses = ["--pose", "0 0 0 0 0 0 1", "--pose", "0.9 0 0 0 0 0 1", "--pose", "0 0.6 0 0 0 0 1"];
    let lines = building.ask(&[&BALL[..], &poses].concat());
    let fits: Vec<&Value> = lines.iter().map(|line| &line["fits"]).collect();
    assert_eq!(fits, [true, false, false]);
    assert_eq!((&lines[1]["voxel"][0], &lines[1]["keep_out"]), (&json!(10), &Value::Null));
    assert_eq!((&lines[2]["voxel"], &lines[2]["keep_out"]), (&Value::Null, &json!("dock")));
    let ignoring = building.ask(&[&BALL[..], &poses, &["--ignore-keep-outs"]].concat());
    assert_eq!(ignoring[2]["fits"], true);

    let room = building.ask(&[&BALL[..], &poses[..2], &["--clearance", "2"]].concat());
    assert!((number(&room[0], "clearance_m") - 0.5).abs() < 1e-6 && room[0]["is_all"] == true, "{room:?}");
    let little = building.says(&[&BALL[..], &poses[..2], &["--clearance", "0.1"]].concat());
    assert_eq!(little, "pose 0 has at least 0.100 m of room\n");

    let way = ["--motion", "--pose", "0 0 0 0 0 0 1", "--pose", "1 0 0 0 0 0 1"];
    let motion = &building.ask(&[&BALL[..], &way].concat())[0];
    assert!(motion["is_free"] == false && (number(motion, "first_hit") - 0.8).abs() < 0.05, "{motion}");
    let free = ["--motion", "--clearance", "1", "--pose", "0 0 0 0 0 0 1", "--pose", "0 -1 0 0 0 0 1"];
    let said = building.says(&[&BALL[..], &free].concat());
    assert_eq!(said, "the motion is free; the least clearance on it is 0.500 m\n");
}

#[test]
fn rays_nearest_voxels_and_a_grid_name_what_they_find() {
    let building = Building::open();
    let rays = building.ask(&["rays", "--from", "0,0,0", "--direction", "1,0,0", "--direction", "0,1,0"]);
    assert!((number(&rays[0], "distance_m") - 1.0).abs() < 1e-6 && rays[0]["voxel"][0] == 10, "{rays:?}");
    assert!((number(&rays[1], "distance_m") - 0.7).abs() < 1e-6 && rays[1]["keep_out"] == "dock", "{rays:?}");
    let nearest = &building.ask(&["nearest", "--point", "0,0.5,0", "--radius", "1"])[0];
    assert!((number(nearest, "distance_m") - 0.2).abs() < 1e-6 && nearest["keep_out"] == "dock", "{nearest}");

    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("a.pgm");
    let grid = &building.ask(&["grid", "--out", image.to_str().unwrap(), "--area", "-0.5 0 0.5 2"])[0];
    assert!(number(grid, "cells_occupied") > 20.0, "{grid}");
    assert!(std::fs::read(&image).unwrap().starts_with(b"P5") && image.with_extension("yaml").exists());
}

#[test]
fn what_nobody_saw_is_told_from_what_is_there() {
    let building = Building::open();
    let told = building.ask(&["classify", "--point", "1.05,0,0", "--point", "0,1,0", "--point", "0.5,0,0"]);
    let states: Vec<&Value> = told.iter().map(|line| &line["state"]).collect();
    assert_eq!(states[..2], ["occupied", "occupied"]);
    assert!(["free", "unknown"].contains(&states[2].as_str().unwrap()), "{told:?}");
    let beyond = ["rays", "--from", "1.5,0,0", "--direction", "1,0,0"];
    assert_eq!(building.ask(&beyond)[0]["hit"], false);
    assert_eq!(building.ask(&[&beyond[..], &["--unknown", "occupied"]].concat())[0]["distance_m"], 0.0);
    let pose = [&BALL[..], &["--pose", "1.5 0 0 0 0 0 1"]].concat();
    assert_eq!(building.ask(&pose)[0]["fits"], true);
    assert_eq!(building.ask(&[&pose[..], &["--unknown", "occupied"]].concat())[0]["fits"], false);
    let said = building.says(&["frontiers", "--box", "5 5 5 6 6 6"]);
    assert_eq!(said, "0 of 0 frontiers, 0 voxels in all\n");
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("a.pgm");
    let out = image.to_str().unwrap();
    let grid = &building.ask(&["grid", "--out", out, "--area", "1.5 0 2.5 1", "--unknown"])[0];
    assert_eq!(grid["cells_free"], 0, "{grid}");
    assert!(std::fs::read(&image).unwrap().ends_with(&[205; 100]));
}

#[test]
fn a_grid_of_another_format_than_pgm_and_one_that_its_own_description_replaces_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["x.yaml", "x.YAML", "x.png", "x"] {
        let out = folder.path().join(name);
        let told = complaint(&["grid", "--map", "a", "--out", out.to_str().unwrap()], 2);
        assert!(told.contains("x.pgm") && !out.exists(), "{told}");
    }
}

#[test]
fn a_grid_counts_from_the_floor_or_says_what_to_give() {
    let building = Building::open();
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("a.pgm");
    let grid = ["grid", "--out", image.to_str().unwrap(), "--band", "-1 1"];
    let told = complaint(&[&grid[..], &["--map", "a", "--server", &building.daemon.grpc]].concat(), 1);
    assert!(told.contains("floor") && told.contains("band_from map"), "{told}");
    let drawn = &building.ask(&[&grid[..], &["--band-from", "map"]].concat())[0];
    assert!(number(drawn, "cells_occupied") > 10.0 && drawn["floor_m"].is_null(), "{drawn}");
}

#[test]
fn a_question_waits_for_a_revision_as_long_as_it_may() {
    let building = Building::open();
    let pose = ["--pose", "0 0 0 0 0 0 1", "--min-revision", "2"];
    assert_eq!(building.ask(&[&BALL[..], &pose].concat())[0]["revision"], 2);
    let ahead = ["--pose", "0 0 0 0 0 0 1", "--min-revision", "3", "--map", "a"];
    let told = complaint(&[&BALL[..], &ahead, &["--server", &building.daemon.grpc]].concat(), 1);
    assert!(told.contains("revision"), "{told}");
}

/// Points of a survey are the map's where its origin is subtracted, and refused where f32 would round them to other
/// voxels.
#[test]
fn points_of_a_survey_are_asked_about_exactly() {
    let (daemon, folder) = (Process::start("", &[]), tempfile::tempdir().unwrap());
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let at = [388_096.0, 3_948_996.0, 12.0];
    let places: Vec<[f64; 3]> = (0..400).map(|i| [0.125 + 0.25 * f64::from(i), 0.0125, 0.0125]).collect();
    let lines = |shift: [f64; 3]| {
        let line = |p: &[f64; 3]| format!("{} {} {}\n", p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]);
        places.iter().map(line).collect::<String>()
    };
    std::fs::write(path("local.xyz"), lines([0.0; 3])).unwrap();
    std::fs::write(path("survey.xyz"), lines(at)).unwrap();
    let on = |arguments: &[&str]| objects(&[arguments, &["--server", &daemon.grpc]].concat());
    let origin = ["--origin", "388096 3948996 12"];
    let made = &on(&[&["maps", "create", "a", "--resolution", "0.025"], &origin[..]].concat())[0];
    assert_eq!(made["settings"]["origin_m"], json!(at), "{made}");
    let answer = &on(&["insert", &path("survey.xyz"), "--map", "a", "--origin", "auto"])[0];
    assert_eq!(answer["accepted"], true, "{answer}");

    let (survey, one) = (path("survey.xyz"), "388146.125,3948996.0125,12.0125");
    let query = |arguments: &[&str]| on(&[&["query", "--map", "a"], arguments].concat());
    assert_eq!(query(&[&survey, "--origin", "auto"])[0]["occupied"], 400);
    assert_eq!(query(&[&[survey.as_str()][..], &origin].concat())[0]["occupied"], 400);
    assert_eq!(query(&["--point", one, "--origin", "auto"])[0]["occupied"], true);
    let classes = on(&["classify", "--map", "a", &survey, "--origin", "auto"]);
    assert!(classes.len() == 400 && classes.iter().all(|line| line["state"] == "occupied"));
    let nearest = on(&["nearest", "--map", "a", &survey, "--radius", "0.1", "--origin", "auto"]);
    assert!(nearest.iter().all(|line| line["distance_m"] == 0.0));
    for command in [
        vec!["query", &survey, "--map", "a"],
        vec!["query", "--point", one, "--map", "a"],
        vec!["classify", &survey, "--map", "a"],
        vec!["nearest", &survey, "--map", "a", "--radius", "0.1"],
        vec!["delete", "--points", &survey, "--map", "a"],
        vec!["localize", &survey, "--name", "a"],
    ] {
        let refused = complaint(&[&command[..], &["--server", &daemon.grpc]].concat(), 1);
        assert!(refused.contains("by more than 1/16 of a voxel of 0.025 m"), "{command:?}: {refused}");
    }
    let wrong = ["query", &survey, "--map", "a", "--origin", "1 2 3", "--server", &daemon.grpc];
    assert!(complaint(&wrong, 2).contains("that of the map is [388096.0, 3948996.0, 12.0]"));
    let removed = on(&["delete", "--points", &survey, "--map", "a", "--origin", "auto"]);
    assert_eq!(removed[0]["removed"], 400);
}
