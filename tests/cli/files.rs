//! `mrol export` and `mrol import`: maps as files of other programs.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use mrol::geometry::Point;
use mrol::map::{MapContents, MapOrigin, MapSettings};
use mrol::planning::{PointState, classify_points};
use mrol::scan::write_ply;
use mrol::store::{Disk, Snapshot};
use mrol::util::StopSignal;
use mrol::voxel::{VoxelKey, VoxelSet};
use mrol_files::npz::{NpzContent, NpzReader};
use mrol_files::octree::{CellState, OctreeReader, OctreeVoxels};
use serde_json::{Value, json};
use uuid::Uuid;

use super::{Sequence, complaint, mrol, objects};
use crate::support::process::Process;
use crate::support::skipped::skipped;

/// What a call says on standard error when it succeeds.
fn notes(arguments: &[&str]) -> String {
    let said = mrol(arguments).assert().success().get_output().stderr.clone();
    String::from_utf8(said).unwrap()
}

fn map_file(path: &str) -> Snapshot {
    Snapshot::read(&Disk::default(), path.as_ref()).unwrap()
}

/// The states of the finest cells of a tree.
fn cells_of(path: &str) -> BTreeMap<[i32; 3], CellState> {
    let bytes = std::fs::read(path).unwrap();
    let mut reader = OctreeReader::new(&bytes[..]).unwrap();
    let mut cells = BTreeMap::new();
    while let Some(leaf) = reader.next_leaf().unwrap() {
        let side = 1 << leaf.level;
        for cell in 0..side * side * side {
            let offset = [cell % side, cell / side % side, cell / (side * side)];
            cells.insert([0, 1, 2].map(|axis| leaf.index[axis] * side + offset[axis]), leaf.state);
        }
    }
    cells
}

/// A map file of a few voxels, none of which a scan saw.
fn written(path: &str, origin: Option<MapOrigin>, voxels: &VoxelSet) {
    let settings = MapSettings { origin, ..MapSettings::new(0.1, 4) };
    let contents = MapContents::at(7, voxels.clone());
    Snapshot { uuid: Uuid::new_v4(), settings, contents }.write(&Disk::default(), path.as_ref()).unwrap();
}

fn some_voxels() -> VoxelSet {
    let index = |k: i32| [k % 7 - 3, -k % 11, k * k % 13 - 6];
    (0..200).map(|k| VoxelKey::new(index(k)).unwrap()).collect()
}

#[test]
fn an_octree_has_the_occupied_voxels_and_what_classify_says_is_free() {
    let sequence = Sequence::of(2);
    let path = |name: &str| sequence.path(name);
    let (scans, map) = (path("scans"), path("a.mrol"));
    objects(&["map", &scans, "--resolution", "0.2", "--levels", "3", "--out", &map]);
    let daemon = Process::start("", &[]);
    objects(&["restore", &map, "--server", &daemon.grpc]);
    let whole = map_file(&map).restore().unwrap();
    for level in [0_u32, 1] {
        let text = level.to_string();
        let (tree, full) = (path("a.bt"), path("a.ot"));
        let told = &objects(&["export", &map, "--level", &text, "--out", &tree])[0];
        let cells = cells_of(&tree);
        let count = |state| cells.values().filter(|cell| **cell == state).count();
        assert_eq!(told["occupied"], count(CellState::Occupied));
        assert_eq!(told["free"], count(CellState::Free));
        assert!(count(CellState::Free) > 50, "{told}");
        // Every cell of the box around the occupied ones is what the map says of its center.
        let side_m = 0.2 * f64::from(1 << level);
        let view = whole.view().with_viewpoints();
        let range = |axis: usize| {
            let along =
                cells.iter().filter(|(_, state)| **state == CellState::Occupied).map(|(i, _)| i[axis]);
            (along.clone().min().unwrap(), along.max().unwrap())
        };
        let [(x0, x1), (y0, y1), (z0, z1)] = [0, 1, 2].map(range);
        for z in z0..=z1 {
            let row = (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| [x, y, z]));
            let row: Vec<[i32; 3]> = row.collect();
            let center =
                |index: &[i32; 3]| Point::from(index.map(|i| ((f64::from(i) + 0.5) * side_m) as f32));
            let centers: Vec<Point> = row.iter().map(center).collect();
            let states = classify_points(&view, &centers, level, StopSignal::NEVER).unwrap();
            for (i, index) in row.iter().enumerate() {
                let expected = match states.state(i) {
                    PointState::Occupied => Some(&CellState::Occupied),
                    PointState::Free => Some(&CellState::Free),
                    PointState::Unknown => None,
                };
                assert_eq!(cells.get(index), expected, "{index:?} of level {level}");
            }
        }
        let bytes = std::fs::read(&tree).unwrap();
        objects(&["export", "--map", "a", "--level", &text, "--out", &tree, "--server", &daemon.grpc]);
        assert!(std::fs::read(&tree).unwrap() == bytes, "level {level} of a server");
        objects(&["export", &map, "--level", &text, "--out", &full]);
        assert_eq!(cells_of(&full), cells);
        let alone = &objects(&["export", &map, "--level", &text, "--no-free", "--out", &tree])[0];
        assert_eq!((&alone["free"], &alone["occupied"]), (&json!(0), &told["occupied"]));
        assert!(cells_of(&tree).values().all(|state| *state == CellState::Occupied));
    }
    daemon.stop();
}

#[test]
fn every_file_of_voxels_comes_back_as_the_map_that_it_was_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, again) = (path("a.mrol"), path("b.mrol"));
    let voxels = some_voxels();
    written(&map, None, &voxels);
    for (name, resolution) in [
        ("a.bt", &[][..]),
        ("a.ot", &[]),
        ("a.npz", &[]),
        ("a.ply", &["--resolution", "0.1"]),
        ("a.pcd", &["--resolution", "0.1"]),
    ] {
        let out = path(name);
        objects(&["export", &map, "--out", &out]);
        let told = &objects(&[&["import", &out, "--levels", "4", "--out", &again], resolution].concat())[0];
        assert_eq!(told["voxels"], voxels.len(), "{name}");
        let read = map_file(&again);
        assert_eq!(read.contents.voxels, voxels, "{name}");
        assert_eq!((read.settings.resolution_m, read.settings.levels), (0.1, 4), "{name}");
        assert_eq!(read.contents.revision, 1);
        // Voxels that are coarser in the file, or in the map that is made of it.
        objects(&["export", &map, "--level", "1", "--out", &out]);
        objects(&["import", &out, "--resolution", "0.2", "--out", &again]);
        let coarse: VoxelSet = voxels.iter().map(|key| key.ancestor(1)).collect();
        assert_eq!(map_file(&again).contents.voxels, coarse, "{name}");
        if resolution.is_empty() {
            objects(&["export", &map, "--out", &out]);
            objects(&["import", &out, "--resolution", "0.2", "--out", &again]);
            assert_eq!(map_file(&again).contents.voxels, coarse, "{name}");
        }
    }
}

#[test]
fn arrays_have_points_in_the_coordinates_of_the_survey_and_bring_the_origin_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, out, again) = (path("a.mrol"), path("a.npz"), path("b.mrol"));
    let origin = MapOrigin::new([388_096.25, 3_948_996.5, -12.0]).unwrap();
    written(&map, Some(origin), &some_voxels());
    objects(&["export", &map, "--out", &out]);
    let mut reader = NpzReader::new(File::open(&out).unwrap()).unwrap();
    assert_eq!(reader.content, NpzContent::Voxels { resolution_m: 0.1 });
    let mut points = Vec::new();
    reader.read_points(|part, _| points.extend_from_slice(part)).unwrap();
    let first = some_voxels().iter().min().unwrap().index();
    let expected = [0, 1, 2].map(|axis| origin.position_m[axis] + (f64::from(first[axis]) + 0.5) * 0.1);
    assert!((0..3).all(|axis| (points[0][axis] - expected[axis]).abs() < 1e-9), "{:?}", points[0]);
    objects(&["import", &out, "--out", &again]);
    let read = map_file(&again);
    assert_eq!((read.settings.origin, read.contents.voxels), (Some(origin), some_voxels()));
    let bytes = std::fs::read(&out).unwrap();
    objects(&["export", &map, "--out", &out]);
    assert!(std::fs::read(&out).unwrap() == bytes, "the same map gives the same file");
}

/// What numpy itself reads, where there is one.
#[test]
fn numpy_reads_the_arrays_without_pickle() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, out) = (path("a.mrol"), path("a.npz"));
    written(&map, Some(MapOrigin::new([1000.0, 0.0, 0.0]).unwrap()), &some_voxels());
    objects(&["export", &map, "--out", &out]);
    let script = "import numpy, sys\n\
         a = numpy.load(sys.argv[1], allow_pickle=False)\n\
         centers = (a['indices'] + 0.5) * a['resolution'] + a['origin']\n\
         assert numpy.allclose(centers, a['points'], atol=1e-9, rtol=0)\n\
         assert len({tuple(i) for i in a['indices'].tolist()}) == len(a['indices'])\n\
         print({n: (a[n].dtype.str, a[n].shape) for n in a.files}, len(a['indices']), int(a['level']), int(a['revision']))";
    let run = |python: &str| std::process::Command::new(python).args(["-c", script, &out]).output().ok();
    let mut ran = ["python3", "/usr/bin/python3"].into_iter().filter_map(run);
    let has_numpy = |ran: &std::process::Output| {
        !String::from_utf8_lossy(&ran.stderr).contains("No module named 'numpy'")
    };
    let Some(ran) = ran.find(has_numpy) else { return skipped("no python3 with numpy") };
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let count = some_voxels().len();
    assert!(said.contains(&format!("'indices': ('<i4', ({count}, 3))")), "{said}");
    assert!(said.trim_end().ends_with(&format!("{count} 0 7")), "{said}");
}

#[test]
fn an_imported_map_is_served_and_knows_no_free_space() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, tree, again) = (path("a.mrol"), path("a.bt"), path("office.mrol"));
    written(&map, None, &some_voxels());
    objects(&["export", &map, "--out", &tree]);
    let said = notes(&["import", &tree, "--out", &again]);
    assert!(
        said.contains("occupied leaves became voxels; 0 free ones and all probabilities are left out"),
        "{said}"
    );
    let daemon = Process::start("", &[]);
    let call = |arguments: &[&str]| objects(&[arguments, &["--server", &daemon.grpc]].concat());
    call(&["restore", &again]);
    let [x, y, z] = some_voxels().iter().next().unwrap().index().map(|i| (f64::from(i) + 0.5) * 0.1);
    let point = format!("{x},{y},{z}");
    let state = |point: &str| call(&["classify", "--map", "office", "--point", point])[0]["state"].clone();
    assert_eq!((state(&point), state("0,0,5")), (Value::from("occupied"), Value::from("unknown")));
    daemon.stop();
}

#[test]
fn a_building_of_octomap_becomes_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let shared = match std::env::var_os("MROL_SCANS") {
        Some(folder) => Path::new(&folder).join("octomap/geb079.bt"),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/octomap/geb079.bt"),
    };
    if !shared.is_file() {
        return skipped(format!("no {} (set MROL_SCANS to the folder of octomap)", shared.display()));
    }
    let out = folder.path().join("geb079.mrol").to_str().unwrap().to_owned();
    let told = &objects(&["import", shared.to_str().unwrap(), "--out", &out])[0];
    let bytes = std::fs::read(&shared).unwrap();
    let read = OctreeVoxels::read(&mut OctreeReader::new(&bytes[..]).unwrap(), 0, |_| {}).unwrap();
    assert_eq!((&told["voxels"], &told["resolution_m"]), (&json!(read.voxels.len()), &json!(0.08)));
    assert!(read.voxels.len() > 100_000);
    assert_eq!(map_file(&out).contents.voxels, read.voxels);
}

#[test]
fn what_cannot_be_imported_is_named_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, tree, arrays, out) = (path("a.mrol"), path("a.bt"), path("a.npz"), path("b.mrol"));
    written(&map, None, &some_voxels());
    objects(&["export", &map, "--out", &tree]);
    objects(&["export", &map, "--out", &arrays]);
    let refused = |code: i32, arguments: &[&str]| {
        let said = complaint(&[&["import"], arguments, &["--out", &out]].concat(), code);
        assert!(!Path::new(&out).exists(), "{said}");
        said
    };
    let cut = std::fs::read(&tree).unwrap();
    std::fs::write(path("cut.bt"), &cut[..cut.len() - 2]).unwrap();
    let said = refused(1, &[&path("cut.bt")]);
    assert!(said.contains("cut.bt: the file ends after ") && said.contains("it was cut off"), "{said}");
    let cut = std::fs::read(&arrays).unwrap();
    std::fs::write(path("cut.npz"), &cut[..cut.len() / 2]).unwrap();
    assert!(refused(1, &[&path("cut.npz")]).contains("cut.npz: no .npz of numpy: "));
    assert!(refused(1, &[&path("none.bt")]).contains("none.bt: "));
    std::fs::write(path("none.xyz"), "").unwrap();
    let said = refused(1, &[&path("none.xyz"), "--resolution", "0.1"]);
    assert!(said.contains("none.xyz: nothing in it is occupied: there is no map to write"), "{said}");
    let said = refused(2, &[&tree, "--resolution", "0.15"]);
    assert!(said.contains("the file's voxels are 0.1 m wide") && said.contains("got 0.15"), "{said}");
    assert!(refused(2, &[&tree, "--origin", "auto"]).contains("--origin: for files of points, and "));
    assert!(refused(2, &[&tree, "--levels", "13"]).contains("levels must lie in 1..=12, got 13"));
    write_ply(Path::new(&path("a.ply")), &[Point::new(1.0, 2.0, 3.0)]).unwrap();
    let said = refused(2, &[&path("a.ply")]);
    assert!(said.contains("--resolution METERS is needed: a file of points does not say"), "{said}");
}

#[test]
fn what_is_read_is_not_replaced_and_a_map_file_is_named_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, scan, poses) = (path("a.mrol"), path("a.ply"), path("poses.txt"));
    written(&map, None, &some_voxels());
    objects(&["export", &map, "--out", &scan]);
    std::fs::write(&poses, "0 0 0 0 0 0 0 1\n").unwrap();
    let files = || [&map, &scan, &poses].map(|path| std::fs::read(path).unwrap());
    let before = files();
    let import = ["import", &scan, "--resolution", "0.1", "--out"];
    assert!(complaint(&[&import[..], &[&scan]].concat(), 2).contains("is to be read, and would be replaced"));
    assert!(complaint(&[&import[..], &[&poses]].concat(), 2).contains("must end in .mrol"));
    let mapping = ["map", &scan, "--resolution", "0.1", "--poses", &poses];
    for out in [&scan, &poses] {
        let said = complaint(&[&mapping[..], &["--trajectory-out", out]].concat(), 2);
        assert!(said.contains("is to be read, and would be replaced"), "{said}");
    }
    assert!(complaint(&[&mapping[..], &["--out", &path("b.ply")]].concat(), 2).contains("must end in .mrol"));
    assert_eq!(files(), before);
}

#[test]
fn an_octree_that_is_too_large_is_refused_with_what_helps() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, out) = (path("a.mrol"), path("a.bt"));
    let ends =
        |indices: [[i32; 3]; 2]| indices.map(|index| VoxelKey::new(index).unwrap()).into_iter().collect();
    written(&map, None, &ends([[-600; 3], [600; 3]]));
    let said = complaint(&["export", &map, "--out", &out], 1);
    assert!(
        said.contains("the box around the map has 1,732,323,601 cells, and at most 268435456 are asked"),
        "{said}"
    );
    assert!(said.contains("take --level 1, or leave free space out by --no-free"), "{said}");
    assert!(!Path::new(&out).exists());
    objects(&["export", &map, "--no-free", "--out", &out]);
    assert_eq!(cells_of(&out).len(), 2);
    written(&map, None, &ends([[0; 3], [40_000, 0, 0]]));
    let said = complaint(&["export", &map, "--no-free", "--out", &out], 1);
    assert!(
        said.contains("voxel [40000, 0, 0] lies beyond an octree") && said.contains("coarser --level"),
        "{said}"
    );
}
