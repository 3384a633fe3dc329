//! Maps that are deleted and made again under one name: nothing of one is ever found in another.

use std::path::Path;
use std::sync::Arc;

use mrol::geometry::Pose;
use mrol::map::{Change, MapName, MapSettings, MultiResolutionMap, RobotName, ScanRecord, TrajectoryPose};
use mrol::store::{DataDir, FileSystem, MapFolder, OpeningProgress, Record, Snapshot, StoreSettings};
use mrol::voxel::{VoxelKey, VoxelSet};
use uuid::Uuid;

use super::simulated::{Fault, SimulatedDisk};

fn office() -> MapName {
    MapName::new("office").unwrap()
}

fn data_dir(disk: &SimulatedDisk) -> DataDir {
    DataDir::on(Arc::new(disk.clone()), Path::new("data"), StoreSettings::default()).unwrap()
}

fn empty() -> MultiResolutionMap {
    MultiResolutionMap::new(MapSettings::new(0.1, 5)).unwrap()
}

fn commit(folder: &MapFolder, map: &MultiResolutionMap, place: i32) {
    let voxels: VoxelSet = (0..9).filter_map(|i| VoxelKey::new([place, i, 0])).collect();
    let pose = TrajectoryPose::new(RobotName::new("r").unwrap(), Pose::identity());
    let change = Change::Insertion(ScanRecord::of_voxels(pose, voxels));
    folder.append(&[&Record::of(&change).unwrap()]).unwrap();
    folder.sync().unwrap();
    map.committer().apply(&change);
}

#[test]
fn a_snapshot_that_is_written_while_its_map_is_deleted_and_made_again_stays_out_of_the_new_one() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (old, old_uuid) = (empty(), Uuid::new_v4());
    let old_folder = data.create(&office(), &Snapshot::of(&old, old_uuid)).unwrap();
    (0..3).for_each(|i| commit(&old_folder, &old, i));
    let late = Snapshot::of(&old, old_uuid);
    data.remove(&old_folder).unwrap();
    let (new, new_uuid) = (empty(), Uuid::new_v4());
    let new_folder = data.create(&office(), &Snapshot::of(&new, new_uuid)).unwrap();
    commit(&new_folder, &new, 9);
    drop(old_folder.save(&late, u64::MAX));
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    assert_eq!(opened.uuid, new_uuid, "the deleted map came back");
    assert!(opened.map.contents() == new.contents(), "the new map lost what was acknowledged");
}

#[test]
fn a_map_that_could_not_be_made_leaves_nothing_to_the_next_of_its_name() {
    let whole = SimulatedDisk::default();
    let first = empty();
    let data = data_dir(&whole);
    whole.set_fault(None);
    data.create(&office(), &Snapshot::of(&first, Uuid::new_v4())).unwrap();
    for at in 0..whole.operations() {
        let disk = SimulatedDisk::default();
        let data = data_dir(&disk);
        let restored = empty();
        let aside =
            data.create(&MapName::new("aside").unwrap(), &Snapshot::of(&restored, Uuid::new_v4())).unwrap();
        (0..3).for_each(|i| commit(&aside, &restored, i));
        disk.set_fault(Some(Fault::Fails(at)));
        let failed = data.create(&office(), &Snapshot::of(&restored, Uuid::new_v4()));
        disk.set_fault(None);
        if failed.is_ok() {
            continue;
        }
        let (new, uuid) = (empty(), Uuid::new_v4());
        let folder = data.create(&office(), &Snapshot::of(&new, uuid)).unwrap();
        commit(&folder, &new, 9);
        for seed in 0..10 {
            let opened = data_dir(&disk.after_crash(seed)).map(&office(), &OpeningProgress::default());
            let opened = opened.unwrap_or_else(|error| panic!("failed at {at}: {error}"));
            assert_eq!(opened.uuid, uuid, "failed at {at}: another map's snapshot was inherited");
            assert!(opened.map.contents() == new.contents(), "failed at {at}: acknowledged changes are lost");
        }
    }
}

#[test]
fn a_map_whose_deletion_failed_acknowledges_nothing_that_the_next_start_sweeps_away() {
    for at in 0..3 {
        let disk = SimulatedDisk::default();
        let data = data_dir(&disk);
        let (map, uuid) = (empty(), Uuid::new_v4());
        let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
        commit(&folder, &map, 1);
        disk.set_fault(Some(Fault::Fails(at)));
        let deleted = data.remove(&folder);
        disk.set_fault(None);
        if deleted.is_ok() {
            continue;
        }
        let pose = TrajectoryPose::new(RobotName::new("r").unwrap(), Pose::identity());
        let change = Change::Insertion(ScanRecord::of_voxels(
            pose,
            [VoxelKey::new([7; 3]).unwrap()].into_iter().collect(),
        ));
        let appended = folder.append(&[&Record::of(&change).unwrap()]).and_then(|_| folder.sync());
        let again = data_dir(&disk.copy());
        let names = again.take_stock().unwrap().maps;
        if appended.is_ok() {
            assert_eq!(names, [office()], "failed at {at}: what was acknowledged since is swept away");
        }
    }
}

#[test]
fn a_segment_of_another_map_is_never_harmless() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    (0..3).for_each(|i| commit(&folder, &map, i));
    folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    let other =
        data.create(&MapName::new("other").unwrap(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    commit(&other, &empty(), 5);
    let segment = |name: &str| {
        let folder = Path::new("data/maps").join(
            disk.list(Path::new("data/maps")).unwrap().into_iter().find(|it| it.starts_with(name)).unwrap(),
        );
        folder.join("journal-00000000000000000001.log")
    };
    let bytes = disk.read(&segment("other")).unwrap();
    disk.create(&segment("office")).unwrap().append(&bytes).unwrap();
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default());
    let error =
        opened.err().map(|error| error.to_string()).expect("another map's segment was called harmless");
    assert!(error.contains("another map's"), "{error}");
}

#[test]
fn revisions_behind_a_snapshot_that_a_damaged_journal_hides_are_missed() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    (0..3).for_each(|i| commit(&folder, &map, i));
    let picture = Snapshot::of(&map, uuid);
    // Acknowledged while the snapshot is encoded.
    commit(&folder, &map, 3);
    folder.save(&picture, u64::MAX).unwrap();
    drop(folder);
    let folder = Path::new("data/maps").join(&disk.list(Path::new("data/maps")).unwrap()[0]);
    let segment = folder.join("journal-00000000000000000001.log");
    let bytes = disk.read(&segment).unwrap();
    disk.create(&segment).unwrap().append(&[&bytes[..100], &vec![0; bytes.len() - 100]].concat()).unwrap();
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default());
    let opened = opened.map(|opened| opened.map.revision());
    assert!(opened.is_err(), "opened at revision {opened:?}, 4 was acknowledged");
}
