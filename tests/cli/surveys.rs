//! `mrol import` and `mrol export` of surveys: LAS, LAZ and E57.

use mrol::store::{Disk, Snapshot};
use mrol::voxel::VoxelKey;
use mrol_files::survey::{E57Reader, LasReader};
use serde_json::json;

use super::{complaint, mrol, objects};

/// A fixture of the crate that reads surveys.
fn fixture(name: &str) -> String {
    format!("{}/crates/files/tests/fixtures/surveys/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn map_file(path: &str) -> Snapshot {
    Snapshot::read(&Disk::default(), path.as_ref()).unwrap()
}

#[test]
fn a_survey_of_seven_digits_goes_in_and_out_and_keeps_its_millimeters() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let map = path("site.mrol");
    // Points 13 mm and 17 mm apart, in voxels of 1 mm: a voxel more or less would show.
    for name in ["plain.las", "plain.laz", "extended.las", "layered.laz"] {
        let origin = "388096.0005 5819450.0005 33.9995";
        let said =
            objects(&["import", &fixture(name), "--resolution", "0.001", "--origin", origin, "--out", &map]);
        assert_eq!(said[0]["voxels"], 300, "{name}");
        assert_eq!(said[0]["origin_m"], json!([388_096.000_5, 5_819_450.000_5, 33.9995]));
        let contents = map_file(&map).contents;
        // In the middle between the faces of voxels, half a millimeter below the points.
        let index = |k: i32| [13 * k - 1, 5999 - 17 * k, k % 50];
        let truth: Vec<VoxelKey> = (0..300).map(|k| VoxelKey::new(index(k)).unwrap()).collect();
        assert!(truth.iter().all(|key| contents.voxels.contains(*key)), "{name}");
    }
    for name in ["out.las", "out.laz", "out.e57"] {
        let out = path(name);
        let said = objects(&["export", &map, "--out", &out]);
        assert_eq!(said[0]["points"], 300);
        let mut points = match name {
            "out.e57" => E57Reader::open(out.as_ref()).unwrap().points(0).unwrap().next_points(1000).unwrap(),
            _ => LasReader::open(out.as_ref()).unwrap().next_points().unwrap(),
        };
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        for (k, point) in points.iter().enumerate() {
            let truth = [388_096.0 + 0.013 * k as f64, 5_819_456.0 - 0.017 * k as f64];
            let off = (point.x - truth[0]).abs().max((point.y - truth[1]).abs());
            assert!(off < 1e-3, "{name}: {off}");
        }
        let again = path("again.mrol");
        let origin = "388096.0005 5819450.0005 33.9995";
        objects(&["import", &out, "--resolution", "0.001", "--origin", origin, "--out", &again]);
        assert!(map_file(&again).contents.voxels == map_file(&map).contents.voxels, "{name}");
    }
}

#[test]
fn coordinates_that_f32_does_not_hold_are_refused_with_the_origin_to_give() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("site.mrol").display().to_string();
    for name in ["plain.laz", "scans.e57"] {
        let error = complaint(&["import", &fixture(name), "--resolution", "0.05", "--out", &map], 1);
        assert!(error.contains(name) && error.contains("--origin"), "{error}");
    }
    let error = complaint(&["import", &fixture("plain.las"), "--out", &map], 2);
    assert!(error.contains("--resolution"), "{error}");
}

#[test]
fn scans_of_an_e57_go_in_at_their_poses_with_viewpoints() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("site.mrol").display().to_string();
    let import = [
        "import",
        &fixture("scans.e57"),
        "--resolution",
        "0.25",
        "--origin",
        "388100 5819500 36",
        "--out",
        &map,
    ];
    let said = mrol(&import).assert().success().get_output().stderr.clone();
    assert!(String::from_utf8_lossy(&said).contains("20 points are left out"), "{said:?}");
    let snapshot = map_file(&map);
    let poses: Vec<[f64; 3]> = snapshot
        .contents
        .trajectory
        .stored()
        .map(|scan| scan.map_from_sensor.translation.vector.into())
        .collect();
    assert_eq!(poses, [[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]]);
    assert!(!snapshot.contents.viewpoints.is_empty());
    // As points alone such voxels are occupied, and nobody knows from where they were seen.
    mrol(&[&import[..], &["--as-points"]].concat()).assert().success();
    let points = map_file(&map).contents;
    assert!(points.trajectory.is_empty() && points.viewpoints.is_empty());
    // Points on the faces between voxels are rounded otherwise.
    let (voxels, of_scans) = (points.voxels.len(), snapshot.contents.voxels.len());
    assert!(voxels.abs_diff(of_scans) * 10 <= of_scans, "{voxels} {of_scans}");
}

#[test]
fn a_survey_in_millimeters_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let lines = (0..200).map(|k| format!("{} {} {}\n", 5000 + k * 13, k * 7 - 900, k % 17 * 100));
    std::fs::write(path("room.xyz"), lines.collect::<String>()).unwrap();
    let said =
        mrol(&["import", &path("room.xyz"), "--resolution", "1", "--out", &path("a.mrol")]).output().unwrap();
    let noted = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success() && noted.contains("in millimeters?"), "{noted}");
}
