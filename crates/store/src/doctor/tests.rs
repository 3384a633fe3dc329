//! Tests of the check of folders.

use std::sync::Arc;

use uuid::Uuid;

use super::diagnose::diagnose;
use super::diagnosis::Diagnosis;
use super::set_aside::{SetAside, set_aside};
use crate::data_folder::DataDir;
use crate::journal::Record;
use crate::map_files;
use crate::progress::OpeningProgress;
use crate::settings::StoreSettings;
use crate::snapshots::Snapshot;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{
    Change, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, MapName, MapSettings,
    MappedScan, MultiResolutionMap, Region, RobotName, ScanRecord, ViewpointRecord,
};
use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};
use mrol_map::voxel::VoxelSet;

fn put(name: &str) -> Change {
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    let act = KeepOutAct::Put { shape, made_by: None, expires_at_ns: None };
    let change = KeepOutChange { name: KeepOutName::new(name).unwrap(), act };
    Change::KeepOut(KeepOutRecord { change, request: None })
}

#[test]
fn keep_outs_before_the_damage_are_counted_and_those_behind_it_are_lost() {
    let data = tempfile::tempdir().unwrap();
    let data_dir = DataDir::open(data.path(), StoreSettings::default()).unwrap();
    let name = MapName::new("office").unwrap();
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
    let folder = data_dir.create(&name, &Snapshot::of(&map, Uuid::from_u128(7))).unwrap();
    for name in ["dock", "lift", "ramp"] {
        folder.append(&[&Record::of(&put(name)).unwrap()]).unwrap();
    }
    folder.sync().unwrap();
    let journal = folder.path().join("journal-00000000000000000001.log");
    drop(folder);
    let mut bytes = std::fs::read(&journal).unwrap();
    let lift = bytes.windows(4).position(|word| word == b"lift").unwrap();
    bytes[lift] ^= 1;
    std::fs::write(&journal, bytes).unwrap();
    let SetAside { revision, keep_outs, .. } = set_aside(&data_dir, &name).unwrap().unwrap();
    assert_eq!((revision, keep_outs), (1, 1));
}

#[test]
fn a_snapshot_whose_keep_outs_the_journal_does_not_make_is_told() {
    let data = tempfile::tempdir().unwrap();
    let data_dir = DataDir::open(data.path(), StoreSettings::default()).unwrap();
    let (name, uuid) = (MapName::new("office").unwrap(), Uuid::from_u128(7));
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
    let folder = data_dir.create(&name, &Snapshot::of(&map, uuid)).unwrap();
    let change = put("dock");
    folder.append(&[&Record::of(&change).unwrap()]).unwrap();
    folder.sync().unwrap();
    map.committer().apply(&change);
    let mut snapshot = Snapshot::of(&map, uuid);
    folder.save(&snapshot, u64::MAX).unwrap();
    assert_eq!(diagnose(&data_dir, &name).unwrap().problems, Vec::<String>::new());

    snapshot.contents.keep_outs = Arc::default();
    let file = folder.path().join(map_files::snapshot_name(1));
    snapshot.write(&**data_dir.files(), &file).unwrap();
    let problems = diagnose(&data_dir, &name).unwrap().problems;
    assert_eq!(problems, ["the snapshot of revision 1 is not what the journal makes"]);
}

#[test]
fn a_snapshot_that_a_kill_left_behind_the_beginning_of_the_journal_is_no_problem() {
    let data = tempfile::tempdir().unwrap();
    let settings = StoreSettings { undo_revisions: 0, ..StoreSettings::default() };
    let data_dir = DataDir::open(data.path(), settings).unwrap();
    let (name, uuid) = (MapName::new("office").unwrap(), Uuid::from_u128(7));
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
    let folder = data_dir.create(&name, &Snapshot::of(&map, uuid)).unwrap();
    let first = folder.path().join(map_files::snapshot_name(0));
    let bytes = std::fs::read(&first).unwrap();
    for names in [["dock", "lift"], ["ramp", "hall"], ["door", "gate"]] {
        for name in names {
            let change = put(name);
            folder.append(&[&Record::of(&change).unwrap()]).unwrap();
            map.committer().apply(&change);
        }
        folder.sync().unwrap();
        folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    }
    drop(folder);
    assert!(!first.exists(), "the snapshot is still there");
    std::fs::write(&first, bytes).unwrap();
    let Diagnosis { problems, snapshots, revision, .. } = diagnose(&data_dir, &name).unwrap();
    assert_eq!((problems, snapshots, revision), (Vec::new(), vec![0, 4, 6], Some(6)));
}

/// A scan that leaves a viewpoint.
fn seen(distance_m: f32) -> Change {
    let points: Vec<_> = (0..9).map(|i| Point::new(distance_m, 0.1 * i as f32, 0.1)).collect();
    let range = Sweep::standing(90.0);
    let image = RangeImage::of_points(&points, range, IMAGE_BYTES_MAX).unwrap();
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    let viewpoint = Some(ViewpointRecord { image, displaced: Vec::new() });
    Change::Insertion(ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, VoxelSet::default()) })
}

#[test]
fn viewpoints_that_cannot_be_read_are_named_and_all_others_are_kept() {
    let data = tempfile::tempdir().unwrap();
    // Both snapshots that are kept name the part.
    let settings = StoreSettings { undo_revisions: 0, ..StoreSettings::default() };
    let data_dir = DataDir::open(data.path(), settings).unwrap();
    let (name, uuid) = (MapName::new("office").unwrap(), Uuid::from_u128(7));
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
    let folder = data_dir.create(&name, &Snapshot::of(&map, uuid)).unwrap();
    let commit = |distance_m: f32| {
        let change = seen(distance_m);
        folder.append(&[&Record::of(&change).unwrap()]).unwrap();
        folder.sync().unwrap();
        map.committer().apply(&change);
    };
    (1..9).for_each(|i| commit(i as f32));
    folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    (9..12).for_each(|i| commit(i as f32));
    folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    commit(12.0);
    let well = diagnose(&data_dir, &name).unwrap();
    assert_eq!((well.problems, well.viewpoints), (Vec::new(), 12));

    let files = ["part", "copy"].map(|it| folder.path().join(format!("viewpoints-{:020}.{it}", 1)));
    drop(folder);
    std::fs::write(&files[1], b"no part any more").unwrap();
    let problems = diagnose(&data_dir, &name).unwrap().problems;
    assert!(problems.iter().all(|problem| problem.contains("1.copy: 16 bytes")), "{problems:?}");
    assert!(data_dir.map(&name, &OpeningProgress::default()).is_ok());
    std::fs::write(&files[0], b"nor this").unwrap();
    let problems = diagnose(&data_dir, &name).unwrap().problems;
    assert!(problems.iter().any(|problem| problem.contains("1.part: 8 bytes")), "{problems:?}");
    let refused = data_dir.map(&name, &OpeningProgress::default()).unwrap_err().to_string();
    assert!(refused.contains("1.part: 8 bytes"), "{refused}");
    let SetAside { revision, viewpoints, .. } = set_aside(&data_dir, &name).unwrap().unwrap();
    assert_eq!((revision, viewpoints), (12, 4));
    assert!(data_dir.map(&name, &OpeningProgress::default()).is_ok());
}
