//! `mrol localize`: scans in a map file, and on a server.

use mrol::geometry::{pose, pose_difference};

use super::{Sequence, complaint, mrol, objects};

#[test]
fn a_scan_of_a_map_file_is_found_where_it_was_taken() {
    let sequence = Sequence::of(3);
    let (scans, truth, map) = (sequence.path("scans"), sequence.path("poses.txt"), sequence.path("map.mrol"));
    objects(&["map", &scans, "--resolution", "0.05", "--truth", &truth, "--at-truth", "--out", &map]);
    let down = sequence.poses[1].inverse_transform_vector(&nalgebra::Vector3::new(0.0, 0.0, -1.0));
    let gravity = format!("{},{},{}", down.x, down.y, down.z);
    let scan = sequence.path("scans/0001.ply");
    let arguments = ["localize", "--map", &map, &scan, "--gravity", &gravity, "--candidates", "2"];
    let found = objects(&arguments);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0]["scan"].as_str(), found[0]["cut_short"].as_bool()), (Some("0001.ply"), Some(false)));
    assert!(found[0]["candidates"].as_array().unwrap().len() <= 2);
    let place = &found[0]["candidates"][0]["map_from_sensor"];
    let translation_m = serde_json::from_value(place["translation_m"].clone()).unwrap();
    let rotation_xyzw = serde_json::from_value(place["rotation_xyzw"].clone()).unwrap();
    let (meters, degrees) = pose_difference(&pose(translation_m, rotation_xyzw).unwrap(), &sequence.poses[1]);
    assert!(meters < 0.05 && degrees < 1.0, "{meters} m, {degrees} degrees: {}", found[0]["reason"]);

    let output = mrol(&arguments).assert().success();
    let table = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    assert!(table.starts_with("0001.ply: ") && table.contains("exhaustive"), "{table}");
    assert!(table.contains("agreement  evidence"), "{table}");
    let rays = &found[0]["candidates"][0]["rays"];
    assert!(
        rays["agreement"].as_f64().unwrap() > 0.9 && rays["of_scan"]["asked"].as_u64().unwrap() > 100,
        "{rays}"
    );
    assert!(found[0]["rivals"].is_array(), "{}", found[0]);
}

#[test]
fn a_scan_that_no_place_is_accepted_for_ends_with_a_code_of_its_own() {
    let sequence = Sequence::of(1);
    let (scan, map, wall) =
        (sequence.path("scans/0000.ply"), sequence.path("map.mrol"), sequence.path("wall.xyz"));
    objects(&["map", &scan, "--resolution", "0.1", "--out", &map]);
    // A blank wall fits along every wall of the map.
    let points = (0..900).map(|i| format!("1 {} {}\n", f64::from(i % 30) * 0.05, f64::from(i / 30) * 0.05));
    std::fs::write(&wall, points.collect::<String>()).unwrap();
    let localize = ["localize", "--map", &map, &wall, "--gravity", "0,0,-1", "--json"];
    let output = mrol(&localize).assert().code(3).get_output().clone();
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["accepted"], false, "{answer}");
}

#[test]
fn what_cannot_be_searched_is_said() {
    let missing = complaint(&["localize", "scan.ply"], 2);
    assert!(missing.contains("--map") || missing.contains("--name"), "{missing}");
    let none = complaint(&["localize", "scan.ply", "--map", "m.mrol", "--gravity", "0,0,0"], 2);
    assert!(none.contains("gravity.in_sensor"), "{none}");
    let disordered = complaint(&["localize", "scan.ply", "--map", "m.mrol", "--box", "1 0 0 0 1 1"], 2);
    assert!(disordered.contains("must not exceed"), "{disordered}");
    let sequence = Sequence::of(1);
    let scan = sequence.path("scans/0000.ply");
    let gone = complaint(&["localize", &scan, "--map", &sequence.path("none.mrol")], 1);
    assert!(gone.contains("none.mrol"), "{gone}");
}
