//! Maps that are deleted and made again under one name: nothing of one is ever found in another.

use std::convert::Infallible;
use std::io;
use std::path::Path;
use std::sync::Arc;

use mrol::geometry::Pose;
use mrol::map::{
    Change, MapContents, MapName, MapSettings, MappedScan, MultiResolutionMap, REVISION_MAX, RobotName,
    ScanRecord,
};
use mrol::store::{
    Appending, DataDir, FileSystem, MapFolder, OpenedMap, OpeningProgress, Record, Snapshot, StoreError,
    StoreSettings,
};
use mrol::util::StopSignal;
use mrol::voxel::{VoxelKey, VoxelSet};
use uuid::Uuid;

use crate::support::simulated_disk::{Fault, SimulatedDisk};

pub(crate) fn office() -> MapName {
    MapName::new("office").unwrap()
}

pub(crate) fn data_dir(disk: &SimulatedDisk) -> DataDir {
    DataDir::on(Arc::new(disk.clone()), Path::new("data"), StoreSettings::default()).unwrap()
}

pub(crate) fn empty() -> MultiResolutionMap {
    MultiResolutionMap::new(MapSettings::new(0.1, 5)).unwrap()
}

pub(crate) fn insertion(place: i32) -> Change {
    let voxels: VoxelSet = (0..9).filter_map(|i| VoxelKey::new([place, i, 0])).collect();
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    Change::Insertion(ScanRecord::of_voxels(pose, voxels))
}

pub(crate) fn commit(folder: &MapFolder, map: &MultiResolutionMap, place: i32) {
    let change = insertion(place);
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
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let change = Change::Insertion(ScanRecord::of_voxels(
            pose,
            [VoxelKey::new([7; 3]).unwrap()].into_iter().collect(),
        ));
        let appended = folder.append(&[&Record::of(&change).unwrap()]).and_then(|_| folder.sync());
        let again = data_dir(&disk.copy());
        let names = again.import_map_files().unwrap().maps;
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

/// A map of four changes under the name, and another to take its place.
struct Exchange {
    data: DataDir,
    old: MultiResolutionMap,
    old_folder: MapFolder,
    new: MultiResolutionMap,
    new_uuid: Uuid,
}

impl Exchange {
    fn on(disk: &SimulatedDisk) -> Self {
        let (data, old, new) = (data_dir(disk), empty(), empty());
        let old_folder = data.create(&office(), &Snapshot::of(&old, Uuid::new_v4())).unwrap();
        (0..4).for_each(|i| commit(&old_folder, &old, i));
        let aside = data.create(&kept(), &Snapshot::of(&new, Uuid::new_v4())).unwrap();
        (10..12).for_each(|i| commit(&aside, &new, i));
        data.remove(&aside).unwrap();
        Self { data, old, old_folder, new, new_uuid: Uuid::new_v4() }
    }

    fn run(&self) -> Result<MapFolder, StoreError> {
        self.data.replace(&office(), &self.old_folder, &kept(), &Snapshot::of(&self.new, self.new_uuid))
    }
}

fn kept() -> MapName {
    MapName::new("office-replaced-4").unwrap()
}

/// The maps that a start finds.
fn found(disk: &SimulatedDisk) -> Vec<(MapName, OpenedMap)> {
    let data = data_dir(disk);
    let stock = data.import_map_files().unwrap();
    assert!(stock.refused.is_empty() && stock.not_understood.is_empty(), "{stock:?}");
    let open = |name: MapName| {
        let opened = data.map(&name, &OpeningProgress::default());
        (name.clone(), opened.unwrap_or_else(|error| panic!("{name}: {error}")))
    };
    stock.maps.into_iter().map(open).collect()
}

#[test]
fn a_crash_at_any_step_of_a_replacement_leaves_one_map_of_the_name_and_loses_neither() {
    let whole = SimulatedDisk::default();
    let exchange = Exchange::on(&whole);
    whole.set_fault(None);
    exchange.run().unwrap();
    let operations = whole.operations();
    assert!(operations > 8, "{operations} operations");
    let (mut before, mut after) = (0, 0);
    for at in 0..=operations {
        for fault in [Fault::Crash(at), Fault::Fails(at)] {
            let disk = SimulatedDisk::default();
            let exchange = Exchange::on(&disk);
            disk.set_fault(Some(fault));
            let exchanged = exchange.run();
            disk.set_fault(None);
            if matches!(fault, Fault::Fails(_)) {
                // Whatever came of it, the old map goes on where it is.
                commit(&exchange.old_folder, &exchange.old, 20);
            }
            for seed in 0..10 {
                let what = format!("{fault:?}, seed {seed}");
                let disk = disk.after_crash(seed);
                let maps = found(&disk);
                let names: Vec<&MapName> = maps.iter().map(|(name, _)| name).collect();
                let contents = |i: usize| maps[i].1.map.contents();
                if names == [&office()] {
                    assert!(exchanged.is_err(), "{what}: the exchange was acknowledged");
                    assert!(contents(0) == exchange.old.contents(), "{what}: another map");
                    before += 1;
                } else {
                    assert_eq!(names, [&office(), &kept()], "{what}");
                    assert!(contents(0) == exchange.new.contents(), "{what}: not the new map");
                    assert!(contents(1) == exchange.old.contents(), "{what}: not the old map");
                    after += 1;
                }
                drop(maps);
                assert_eq!(found(&disk).len(), data_dir(&disk).names().unwrap().len(), "{what}, and again");
            }
        }
    }
    assert!(before > 20 && after > 20, "{before} before, {after} after");
}

#[test]
fn a_folder_of_a_former_release_gets_its_uuid_and_loses_nothing() {
    let disk = SimulatedDisk::default();
    let (data, map, uuid) = (data_dir(&disk), empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    (0..3).for_each(|i| commit(&folder, &map, i));
    let maps = Path::new("data/maps");
    disk.rename(&maps.join(format!("office.{uuid}")), &maps.join("office")).unwrap();
    disk.sync(maps).unwrap();
    for at in 0..4 {
        let disk = disk.copy();
        disk.set_fault(Some(Fault::Crash(at)));
        drop(data_dir(&disk).map(&office(), &OpeningProgress::default()));
        for seed in 0..10 {
            let disk = disk.after_crash(seed);
            let maps = found(&disk);
            assert_eq!((maps.len(), &maps[0].0, maps[0].1.uuid), (1, &office(), uuid));
            assert!(maps[0].1.map.contents() == map.contents());
            assert_eq!(disk.list(Path::new("data/maps")).unwrap(), [format!("office.{uuid}")]);
        }
    }
}

#[test]
fn two_folders_of_one_name_are_reported_with_both_named() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    data.create(&office(), &Snapshot::of(&empty(), Uuid::from_u128(1))).unwrap();
    disk.create_folder(Path::new("data/maps/office")).unwrap();
    let error = data.map(&office(), &OpeningProgress::default()).unwrap_err().to_string();
    assert!(error.contains("data/maps/office,") || error.contains("data/maps/office and"), "{error}");
    assert!(error.contains(&format!("office.{}", Uuid::from_u128(1))), "{error}");
    assert_eq!(data.names().unwrap(), [office()]);
    assert!(data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).is_err());
}

#[test]
fn a_map_takes_no_more_changes_than_there_are_revisions() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let contents = MapContents::at(REVISION_MAX - 1, VoxelSet::default());
    let map = MultiResolutionMap::restore(MapSettings::new(0.1, 5), contents).unwrap();
    let folder = data.create(&office(), &Snapshot::of(&map, Uuid::new_v4())).unwrap();
    commit(&folder, &map, 1);
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    let more = Change::Insertion(ScanRecord::of_voxels(pose, VoxelSet::default()));
    let refused = folder.append(&[&Record::of(&more).unwrap()]).unwrap_err();
    assert!(matches!(refused, StoreError::RevisionsUsedUp(REVISION_MAX)), "{refused}");
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    assert!(opened.map.contents() == map.contents(), "the last acknowledged change is lost");
}

#[test]
fn what_undo_alone_needs_is_bounded_in_bytes_and_stays_while_it_is_read() {
    let disk = SimulatedDisk::default();
    let settings = StoreSettings { undo_bytes_max: 4000, ..StoreSettings::default() };
    let data = DataDir::on(Arc::new(disk.clone()), Path::new("data"), settings).unwrap();
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    let grow = |from: i32| {
        (from..from + 10).for_each(|i| commit(&folder, &map, i));
        folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    };
    grow(0);
    let scan = folder.used().kept_from;
    let all = |_| Ok::<_, Infallible>(());
    let reading = folder.observations(map.settings(), &[scan], &[], all, StopSignal::NEVER).unwrap();
    (1..20).for_each(|i| grow(i * 10));
    assert_eq!(folder.used().kept_from, scan, "what is read went");
    let mut reading = reading;
    folder.observe(&mut reading, StopSignal::NEVER).unwrap();
    assert_eq!(reading.revision, 200);
    drop(reading);
    grow(200);
    let reach = folder.used().kept_from;
    assert!(reach > 100 && reach < 200, "undo reaches back to {reach}");
    assert!(folder.give_up_undo().unwrap());
    assert_eq!(folder.used().kept_from, 201);
    assert!(!folder.give_up_undo().unwrap());
    drop((folder, data));
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    assert!(opened.map.contents() == map.contents());
}

#[test]
fn an_opening_that_nobody_wants_any_more_ends() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    let progress = OpeningProgress::default();
    progress.cancel();
    assert!(matches!(data.map(&office(), &progress), Err(StoreError::Cancelled)));
}

/// A disk on which nobody wants the maps any more once a map's snapshot was read.
#[derive(Debug)]
struct Unwanted {
    disk: SimulatedDisk,
    progress: Arc<OpeningProgress>,
}

impl FileSystem for Unwanted {
    fn read(&self, file: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.disk.read(file);
        self.progress.cancel();
        bytes
    }

    fn create_folder(&self, folder: &Path) -> io::Result<()> {
        self.disk.create_folder(folder)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        self.disk.list(folder)
    }

    fn size(&self, file: &Path) -> io::Result<u64> {
        self.disk.size(file)
    }

    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>> {
        self.disk.create(file)
    }

    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()> {
        self.disk.truncate(file, bytes)
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        self.disk.sync(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.disk.rename(from, to)
    }

    fn remove(&self, file: &Path) -> io::Result<()> {
        self.disk.remove(file)
    }

    fn remove_folder(&self, folder: &Path) -> io::Result<()> {
        self.disk.remove_folder(folder)
    }
}

#[test]
fn an_opening_ends_inside_a_snapshot_which_nobody_takes_for_damaged() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    (0..3).for_each(|i| commit(&folder, &map, i));
    folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    drop((folder, data));
    let progress = Arc::new(OpeningProgress::default());
    let unwanted = Unwanted { disk: disk.clone(), progress: Arc::clone(&progress) };
    let data = DataDir::on(Arc::new(unwanted), Path::new("data"), StoreSettings::default()).unwrap();
    let opened = data.map(&office(), &progress);
    assert!(matches!(opened, Err(StoreError::Cancelled)), "{:?}", opened.map(|opened| opened.uuid));
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    assert!(opened.damaged.is_empty() && opened.map.contents() == map.contents());
}

#[test]
fn where_nothing_is_left_to_give_up_nothing_is_written_or_synced() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    let grow = |from: i32| {
        (from..from + 10).for_each(|i| commit(&folder, &map, i));
        folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    };
    (0..5).for_each(|i| grow(i * 10));
    assert!(folder.give_up_undo().unwrap());
    let before = disk.operations();
    for _ in 0..20 {
        assert!(!folder.give_up_undo().unwrap());
    }
    assert_eq!(disk.operations() - before, 0, "a scarce disk is written to");
    (5..8).for_each(|i| grow(i * 10));
    assert!(folder.give_up_undo().unwrap(), "what has come since is given up too");
}
