//! What a failed operation leaves, and what somebody else put there: the first is never served, the second never
//! removed.

use std::cell::Cell;
use std::convert::Infallible;
use std::path::Path;

use mrol::map::WithdrawnChange;
use mrol::store::{FileSystem, NotObserved, OpeningProgress, Record, Snapshot, StoreError};
use mrol::util::StopSignal;
use uuid::Uuid;

use super::incarnations::{commit, data_dir, empty, insertion, office};
use crate::support::simulated_disk::{Fault, SimulatedDisk};

const MAPS: &str = "data/maps";

fn put(disk: &SimulatedDisk, path: &Path, bytes: &[u8]) {
    disk.create(path).unwrap().append(bytes).unwrap();
}

/// The names of the maps that a start finds.
fn maps(disk: &SimulatedDisk) -> Vec<String> {
    let stock = data_dir(disk).import_map_files().unwrap();
    stock.maps.iter().map(ToString::to_string).collect()
}

#[test]
fn a_map_whose_creation_failed_is_not_there_after_a_restart() {
    let whole = SimulatedDisk::default();
    let data = data_dir(&whole);
    whole.set_fault(None);
    data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    let operations = whole.operations();
    let mut failed = 0;
    for at in 0..operations {
        let disk = SimulatedDisk::default();
        let data = data_dir(&disk);
        disk.set_fault(Some(Fault::Fails(at)));
        let made = data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4()));
        disk.set_fault(None);
        if made.is_ok() {
            continue;
        }
        failed += 1;
        assert_eq!(
            maps(&disk.copy()),
            [""; 0],
            "operation {at} failed, and the map is there after a restart"
        );
        for seed in 0..10 {
            let disk = disk.after_crash(seed);
            assert_eq!(maps(&disk), [""; 0], "operation {at} failed, and the map is there, seed {seed}");
        }
    }
    assert!(failed > 3, "{failed} of {operations} operations");
}

#[test]
fn a_full_disk_keeps_no_map_from_being_opened() {
    let (disk, map, uuid) = (SimulatedDisk::default(), empty(), Uuid::new_v4());
    let folder = data_dir(&disk).create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    commit(&folder, &map, 1);
    folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    // The next record begins a segment: its file is made, and half of its header written.
    disk.set_fault(Some(Fault::Full));
    assert!(folder.append(&[&Record::of(&insertion(2)).unwrap()]).is_err());
    drop(folder);
    for _ in 0..2 {
        let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
        assert!(opened.map.contents() == map.contents());
        assert!(opened.folder.append(&[&Record::of(&insertion(2)).unwrap()]).is_err());
    }
    disk.set_fault(None);
    let opened = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    commit(&opened.folder, &opened.map, 2);
    let contents = opened.map.contents();
    drop(opened);
    let again = data_dir(&disk).map(&office(), &OpeningProgress::default()).unwrap();
    assert!(again.map.contents() == contents);
}

#[test]
fn a_map_that_could_not_be_taken_in_is_not_served_meanwhile() {
    let file = Snapshot::of(&empty(), Uuid::new_v4()).encode().unwrap();
    let mut left = 0;
    for at in 0..12 {
        let disk = SimulatedDisk::default();
        let data = data_dir(&disk);
        put(&disk, &Path::new(MAPS).join("office.mrol"), &file);
        // What failed cannot be taken back either.
        disk.set_fault(Some(Fault::Crash(at)));
        let stock = data.import_map_files();
        disk.set_fault(None);
        let Some((_, error)) = stock.ok().and_then(|mut stock| stock.refused.pop()) else { continue };
        let folders = disk.list(Path::new(MAPS)).unwrap();
        // Only the file could not be removed.
        if error.to_string().contains("office.mrol") {
            continue;
        }
        left += usize::from(folders.iter().any(|name| name.starts_with("office.") && name != "office.mrol"));
        let served = data.map(&office(), &OpeningProgress::default());
        assert!(matches!(served, Err(StoreError::NoFolder(_))), "operation {at} failed: {folders:?}");
    }
    assert!(left > 0, "nothing was ever left");
}

#[test]
fn a_folder_without_a_snapshot_is_reported_and_stays() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    let bare = Path::new(MAPS).join(format!("bare.{}", Uuid::from_u128(7)));
    disk.create_folder(&bare).unwrap();
    let data = data_dir(&disk);
    let stock = data.import_map_files().unwrap();
    assert_eq!(stock.maps.len(), 2);
    let error = data.map(&stock.maps[0], &OpeningProgress::default()).unwrap_err().to_string();
    assert!(error.contains("bare."), "{error}");
    assert!(data.map(&office(), &OpeningProgress::default()).is_ok());
    assert!(disk.list(&bare).is_ok());
}

#[test]
fn what_somebody_put_beside_a_map_is_reported_and_never_removed() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let (map, uuid) = (empty(), Uuid::new_v4());
    let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    // A backup of the map itself, which has gone on since; one of another of its name; and what is no map.
    let backup = Snapshot::of(&map, uuid).encode().unwrap();
    commit(&folder, &map, 1);
    drop((folder, data));
    let other = Snapshot::of(&map, Uuid::new_v4()).encode().unwrap();
    let beside = ["office.mrol.bak", "notes.txt", "office.tar"].map(|name| Path::new(MAPS).join(name));
    beside.iter().for_each(|path| put(&disk, path, b"mine"));
    let file = Path::new(MAPS).join("office.mrol");
    for bytes in [&backup[..], &other, b"no map file"] {
        put(&disk, &file, bytes);
        let data = data_dir(&disk);
        let stock = data.import_map_files().unwrap();
        assert_eq!((stock.refused.len(), &stock.refused[0].0), (1, &office()));
        assert!(stock.refused[0].1.to_string().contains("office.mrol"), "{}", stock.refused[0].1);
        let mut reported = stock.not_understood;
        reported.sort();
        assert_eq!(reported.len(), beside.len(), "{reported:?}");
        assert!(beside.iter().all(|path| reported.contains(path) && disk.read(path).unwrap() == b"mine"));
        assert!(disk.read(&file).is_ok_and(|there| there == bytes), "the backup was removed");
        let opened = data.map(&office(), &OpeningProgress::default()).unwrap();
        assert!(opened.map.contents() == map.contents(), "the map is not as it was");
    }
}

#[test]
fn undo_that_cannot_be_given_up_loses_nothing() {
    let grown = || {
        let (disk, map, uuid) = (SimulatedDisk::default(), empty(), Uuid::new_v4());
        let folder = data_dir(&disk).create(&office(), &Snapshot::of(&map, uuid)).unwrap();
        for i in 0..6 {
            commit(&folder, &map, i);
            folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
        }
        (disk, map, folder)
    };
    let (disk, _, folder) = grown();
    disk.set_fault(None);
    assert!(folder.give_up_undo().unwrap());
    let operations = disk.operations();
    assert!(operations > 2, "{operations} operations");
    for at in 0..operations {
        let (disk, map, folder) = grown();
        disk.set_fault(Some(Fault::Fails(at)));
        let refused = folder.give_up_undo();
        disk.set_fault(None);
        assert!(refused.is_err(), "operation {at} failed, and nothing was said");
        // The map goes on, and gives up what it could not the next time.
        commit(&folder, &map, 9);
        folder.give_up_undo().unwrap();
        for seed in 0..10 {
            let opened = data_dir(&disk.after_crash(seed)).map(&office(), &OpeningProgress::default());
            let opened = opened.unwrap_or_else(|error| panic!("operation {at} failed: {error}"));
            assert!(opened.map.contents() == map.contents(), "operation {at} failed: changes are lost");
        }
    }
}

#[test]
fn undo_reaches_what_it_is_said_to_reach() {
    let (disk, map, uuid) = (SimulatedDisk::default(), empty(), Uuid::new_v4());
    let folder = data_dir(&disk).create(&office(), &Snapshot::of(&map, uuid)).unwrap();
    for snapshot in [10, 20] {
        while map.revision() < snapshot {
            commit(&folder, &map, map.revision() as i32);
        }
        folder.save(&Snapshot::of(&map, uuid), u64::MAX).unwrap();
    }
    (0..5).for_each(|i| commit(&folder, &map, i));
    folder.give_up_undo().unwrap();
    let reach = |withdrawn: &[WithdrawnChange]| {
        let from = folder.undo_from(withdrawn);
        let all = |_| Ok::<_, Infallible>(());
        let observe = |scan| folder.observations(map.settings(), &[scan], withdrawn, all, StopSignal::NEVER);
        assert!(from > map.revision() || observe(from).is_ok());
        assert!(matches!(observe(from - 1), Err(NotObserved::OutsideUndoWindow)));
        from
    };
    // The snapshots of revisions 10 and 20 are left.
    assert_eq!(reach(&[]), 11);
    assert_eq!(reach(&[WithdrawnChange { change: 5, revision: 18 }]), 21);
    assert_eq!(reach(&[WithdrawnChange { change: 15, revision: 24 }]), 11);
    assert_eq!(reach(&[WithdrawnChange { change: 5, revision: 24 }]), 26);
}

#[test]
fn reading_for_an_undo_looks_at_the_signal_at_each_record() {
    const RECORDS: usize = 50;
    let (disk, map) = (SimulatedDisk::default(), empty());
    let folder = data_dir(&disk).create(&office(), &Snapshot::of(&map, Uuid::new_v4())).unwrap();
    (0..RECORDS as i32).for_each(|i| commit(&folder, &map, i));
    let looks = Cell::new(0);
    let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
    let all = |_| Ok::<_, Infallible>(());
    folder.observations(map.settings(), &[1], &[], all, StopSignal::when(&count_look)).unwrap();
    assert!(looks.get() >= RECORDS, "{} looks", looks.get());
}
