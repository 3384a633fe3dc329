//! `mrol map`: scans to a map, without a server.

use mrol::geometry::pose_difference;
use mrol::scan::read_trajectory;
use mrol::store::{Disk, Snapshot};
use serde_json::json;

use super::support::box_in_room::room;
use super::{Sequence, complaint, mrol, objects};

const SCANS: usize = 4;

#[test]
fn a_sequence_becomes_lines_a_trajectory_and_a_map() {
    let sequence = Sequence::of(SCANS);
    let (scans, trajectory, map) =
        (sequence.path("scans"), sequence.path("out.txt"), sequence.path("out.mrol"));
    let pose = sequence.first_pose();
    let lines = objects(&[
        "map",
        &scans,
        "--resolution",
        "0.05",
        "--levels",
        "5",
        "--first-pose",
        &pose,
        "--trajectory-out",
        &trajectory,
        "--out",
        &map,
    ]);
    assert_eq!(lines.len(), SCANS);
    for (k, line) in lines.iter().enumerate() {
        assert_eq!(line["scan"], format!("{k:04}.ply"));
        assert_eq!((line["accepted"].as_bool(), line["verdict"].as_str()), (Some(true), Some("accepted")));
        assert_eq!(line["map_from_sensor"]["translation_m"].as_array().unwrap().len(), 3);
        for number in ["overlap", "align_ms", "insert_ms"] {
            assert!(line[number].as_f64().unwrap() >= 0.0, "{number}");
        }
        assert!(line["reason"].as_str().is_some_and(|reason| !reason.is_empty()));
        assert_eq!(line["information"].as_array().unwrap().len(), 6);
        assert!(line["points_skipped"].is_u64());
        assert_eq!(line["carved_voxels"], 0);
        assert_eq!(line.as_object().unwrap().len(), 16);
    }
    let added: u64 = lines.iter().map(|line| line["new_voxels"].as_u64().unwrap()).sum();
    assert_eq!(lines[SCANS - 1]["voxels"].as_u64().unwrap(), added);

    let poses = read_trajectory(trajectory.as_ref()).unwrap();
    assert_eq!(poses.iter().map(|pose| pose.id).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0]);
    for (found, truth) in poses.iter().zip(&sequence.poses) {
        let (meters, degrees) = pose_difference(&found.map_from_sensor, truth);
        assert!(meters < 0.02 && degrees < 0.3, "{meters} m {degrees} degrees");
    }
    let snapshot = Snapshot::read(&Disk::default(), map.as_ref()).unwrap().contents;
    assert_eq!((snapshot.voxels.len() as u64, snapshot.trajectory.len()), (added, SCANS));
}

#[test]
fn the_first_scan_of_a_camera_is_put_upright_at_the_height_of_the_sensor() {
    let sequence = Sequence::of(1);
    let scans = sequence.path("scans");
    let first_pose = |more: &[&str]| {
        let lines = objects(&[&["map", &scans, "--resolution", "0.05"], more].concat());
        let pose = &lines[0]["map_from_sensor"];
        (pose["translation_m"].clone(), pose["rotation_xyzw"].clone())
    };
    assert_eq!(first_pose(&[]), (json!([0.0, 0.0, 0.0]), json!([0.0, 0.0, 0.0, 1.0])));
    assert_eq!(
        first_pose(&["--axes", "optical", "--sensor-height", "1.2"]),
        (json!([0.0, 0.0, 1.2]), json!([-0.5, 0.5, -0.5, 0.5]))
    );
}

#[test]
fn errors_are_against_the_first_pose_wherever_the_map_begins() {
    let sequence = Sequence::of(SCANS);
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let lines = objects(&["map", &scans, "--resolution", "0.05", "--levels", "5", "--truth", &truth]);
    assert_eq!(lines[0]["error_m"], 0.0);
    assert_eq!(
        lines[0]["map_from_sensor"],
        serde_json::json!({"translation_m": [0.0, 0.0, 0.0], "rotation_xyzw": [0.0, 0.0, 0.0, 1.0]})
    );
    let summary = &lines[SCANS]["summary"];
    let errors = lines[..SCANS].iter().map(|line| line["error_m"].as_f64().unwrap());
    assert_eq!(summary["error_m"]["max"].as_f64(), errors.reduce(f64::max));
    assert!(summary["error_m"]["max"].as_f64().unwrap() < 0.06, "{summary}");
    assert_eq!((summary["scans"].as_u64(), summary["refused"].as_u64()), (Some(4), Some(0)));
}

#[test]
fn scans_at_their_true_poses_have_no_error() {
    let sequence = Sequence::of(SCANS);
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let lines = objects(&["map", &scans, "--resolution", "0.05", "--truth", &truth, "--at-truth"]);
    assert!(lines[SCANS]["summary"]["error_m"]["max"].as_f64().unwrap() < 1e-9);
    assert!(lines[SCANS - 1]["overlap"].as_f64().unwrap() > 0.5);
}

#[test]
fn a_scan_that_does_not_fit_is_left_out_of_map_and_trajectory() {
    let sequence = Sequence::of(2);
    let (scans, trajectory) = (sequence.path("scans"), sequence.path("out.txt"));
    let lines = objects(&[
        "map",
        &scans,
        "--resolution",
        "0.05",
        "--min-overlap",
        "1",
        "--trajectory-out",
        &trajectory,
    ]);
    assert_eq!(
        (lines[1]["accepted"].as_bool(), lines[1]["verdict"].as_str()),
        (Some(false), Some("low_overlap"))
    );
    assert_eq!(lines[1]["voxels"], lines[0]["voxels"]);
    assert_eq!(read_trajectory(trajectory.as_ref()).unwrap().len(), 1);
}

#[test]
fn ample_filters_are_told_from_small_ones_and_find_the_poses_of_the_exact_sets() {
    let sequence = Sequence::of(3);
    let scans = sequence.path("scans");
    let run = |options: &[&str]| {
        let common = ["map", &scans, "--resolution", "0.1", "--lookup"];
        objects(&[&common, options].concat())
    };
    let ample = run(&["bloom", "--filter-hashes", "10", "--filter-bits-per-key", "2000"]);
    let filter = &ample[3]["summary"]["filter"];
    assert_eq!(filter["ample"], true, "{filter}");
    assert!(filter["lookups"].as_u64().unwrap() > 1_000_000);
    let small = run(&["bloom", "--filter-bits-per-key", "8"]);
    assert_eq!(small[3]["summary"]["filter"]["ample"], false);
    let exact = run(&["exact"]);
    assert!(exact[3]["summary"]["filter"].is_null());
    for k in 0..3 {
        assert_eq!(ample[k]["map_from_sensor"], exact[k]["map_from_sensor"]);
    }
}

#[test]
fn people_get_a_table() {
    let sequence = Sequence::of(2);
    let output = mrol(&["map", &sequence.path("scans"), "--resolution", "0.1"]).assert().success();
    let table = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    assert!(table.starts_with("2 scans, from 0000.ply to 0001.ply\nscan "), "{table}");
    assert!(table.contains("0001.ply  accepted"), "{table}");
    assert!(table.contains("2 scans, 2 accepted, 0 refused"), "{table}");
    assert!(table.ends_with("the map is not kept: --out FILE.mrol writes it\n"), "{table}");
    assert!(!table.contains("filters:"), "{table}");
}

/// What a call prints for people, and what it says on standard error.
fn texts(arguments: &[&str]) -> (String, String) {
    let output = mrol(arguments).assert().success().get_output().clone();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (stdout, stderr)
}

#[test]
fn what_was_written_is_told_with_what_can_be_done_with_it() {
    let sequence = Sequence::of(1);
    let (scans, out, poses) = (sequence.path("scans"), sequence.path("a.mrol"), sequence.path("out.txt"));
    let options = ["--resolution", "0.1", "--out", &out, "--trajectory-out", &poses, "--lookup", "bloom"];
    let (table, _) = texts(&[&["map", &scans], &options[..]].concat());
    let last = format!("poses written to {poses}; map written to {out}; `mrol restore {out}` puts it on a");
    assert!(table.starts_with("1 scan: 0000.ply\n") && table.contains(&last), "{table}");
    // The filters are told of where somebody asks for them.
    assert!(table.contains("filters: "), "{table}");
}

#[test]
fn files_that_a_pattern_of_the_shell_names_are_taken_as_given_and_that_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [ten, two] = ["scan10.xyz", "scan2.xyz"].map(path);
    for file in [&ten, &two] {
        std::fs::write(file, "1 0 0\n0 1 0\n0 0 1\n").unwrap();
    }
    let whole = path("");
    let (table, said) = texts(&["map", &whole, "--resolution", "1"]);
    assert!(
        table.starts_with("2 scans, from scan2.xyz to scan10.xyz\n") && said.is_empty(),
        "{table} {said}"
    );
    let (table, said) = texts(&["map", &ten, &two, "--resolution", "1"]);
    assert!(table.starts_with("2 scans, from scan10.xyz to scan2.xyz\n"), "{table}");
    assert!(said.contains("scan10.xyz before scan2.xyz; a folder is read in the natural order"), "{said}");
}

#[test]
fn poses_put_scans_where_truth_with_at_truth_puts_them() {
    let sequence = Sequence::of(2);
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let map = |options: &[&str]| {
        let mut lines = objects(&[&["map", &scans, "--resolution", "0.05"], options].concat());
        let places: Vec<_> = lines.drain(..2).map(|line| line["map_from_sensor"].clone()).collect();
        places
    };
    assert_eq!(map(&["--poses", &truth]), map(&["--truth", &truth, "--at-truth"]));
    complaint(&["map", &scans, "--resolution", "0.05", "--poses", &truth, "--truth", &truth], 2);
}

#[test]
fn scans_carve_what_they_see_through_where_they_are_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let files = ["1.xyz", "2.xyz"].map(path);
    for (file, has_box) in files.iter().zip([true, false]) {
        let lines = room(has_box).into_iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
        std::fs::write(file, lines.collect::<String>()).unwrap();
    }
    let poses = path("poses.txt");
    std::fs::write(&poses, "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").unwrap();
    let map = |options: &[&str]| {
        let files = files.each_ref().map(String::as_str);
        // A room looks the same turned around, so that its poses have to be told.
        objects(&[&["map", "--resolution", "0.1", "--poses", &poses], &files[..], options].concat())
    };
    let carved = |options: &[&str]| map(options)[1]["carved_voxels"].as_u64().unwrap();
    assert_eq!((carved(&[]), carved(&["--carve=false"])), (0, 0));
    let (grown, carved) = (map(&[]), map(&["--carve"]));
    let (count, voxels) =
        (carved[1]["carved_voxels"].as_u64().unwrap(), carved[1]["voxels"].as_u64().unwrap());
    assert!(count > 50, "{count}");
    assert_eq!(grown[1]["voxels"].as_u64().unwrap(), voxels + count);
}

#[test]
fn points_in_millimeters_are_told_with_their_range_and_span() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.xyz");
    let on_wall = |k: u32| {
        let angle = 0.05 * f64::from(k);
        format!("{:.1} {:.1} {:.1}\n", 3000.0 * angle.cos(), 2500.0 * angle.sin(), f64::from(k % 9) * 250.0)
    };
    std::fs::write(&path, (0..120).map(on_wall).collect::<String>()).unwrap();
    let (_, said) = texts(&["map", path.to_str().unwrap(), "--resolution", "0.05"]);
    assert!(
        said.contains("room.xyz: the median range of its points is 2") && said.contains("span 59"),
        "{said}"
    );
    assert!(said.contains("are they in millimeters?"), "{said}");
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    use std::process::{Command, Stdio};
    let sequence = Sequence::of(2);
    let scans = sequence.path("scans");
    let mut child = Command::new(env!("CARGO_BIN_EXE_mrol"))
        .args(["map", &scans, "--resolution", "0.1", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
}

#[test]
fn a_survey_in_doubles_makes_the_same_map_as_its_points_near_0() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A wall of 80 x 80 points, each in the middle of a voxel of its own.
    let local = |i: usize| [0.025 + 0.05 * (i % 80) as f64, 0.025 + 0.05 * (i / 80) as f64, 0.025];
    let write = |name: &str, at: [f64; 3]| {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 6400\nproperty double x\n\
                      property double y\nproperty double z\nend_header\n";
        let points = (0..6400).flat_map(|i| (0..3).flat_map(move |c| (local(i)[c] + at[c]).to_le_bytes()));
        std::fs::write(path(name), header.bytes().chain(points).collect::<Vec<u8>>()).unwrap();
    };
    let at = [388_096.0, 3_948_996.0, 12.0];
    write("local.ply", [0.0; 3]);
    write("survey.ply", at);
    let map = |scan: &str, options: &[&str]| {
        let (scan, out) = (path(scan), path("out.mrol"));
        objects(&[&["map", &scan, "--resolution", "0.05", "--out", &out], options].concat());
        let snapshot = Snapshot::read(&Disk::default(), out.as_ref()).unwrap();
        (snapshot.contents.voxels.clone(), snapshot.settings.origin.map(|origin| origin.position_m))
    };
    let (expected, none) = map("local.ply", &[]);
    assert_eq!((expected.len(), none), (6400, None));
    let poses = path("poses.txt");
    std::fs::write(&poses, "0 -388096 -3948996 -12 0 0 0 1\n").unwrap();
    let to_0 = "-388096 -3948996 -12 0 0 0 1";
    assert!(map("survey.ply", &["--first-pose", to_0]) == (expected.clone(), None));
    assert!(map("survey.ply", &["--truth", &poses, "--at-truth"]) == (expected.clone(), None));
    let origin = Some(at);
    assert!(map("survey.ply", &["--origin", "388096 3948996 12"]) == (expected.clone(), origin));
    let trajectory = path("trajectory.txt");
    let (voxels, found) = map("survey.ply", &["--origin", "auto", "--trajectory-out", &trajectory]);
    assert!(voxels == expected && found == origin, "{found:?}");
    // Exports are in the coordinates of the survey again, in which this scan was not moved.
    let pose = read_trajectory(trajectory.as_ref()).unwrap()[0].map_from_sensor;
    assert!(pose.translation.vector.norm() < 1e-6, "{pose}");
    let refused = complaint(&["map", &path("survey.ply"), "--resolution", "0.05"], 1);
    assert!(
        refused.contains("survey.ply") && refused.contains("--origin \"388096 3948996 12\""),
        "{refused}"
    );
}
