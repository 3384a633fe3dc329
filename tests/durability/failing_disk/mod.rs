//! Maps on a disk that fails: power that goes at any moment, a write that fails or falls short, a sync that fails, a
//! rename that is lost, a bit that flips. What was acknowledged is there afterwards, or the refusal says what is not;
//! the map is never another one.

#![expect(unreachable_pub, reason = "a test has no crate to reach it from")]

mod incarnations;
mod leaving;
mod leftovers;
mod renaming;
mod workload;

use std::path::{Path, PathBuf};

use mrol::store::{FileSystem, OpenedMap, StoreError};
use workload::{History, MAPS, open, run};

use crate::support::simulated_disk::{Fault, SimulatedDisk};

/// What the map is after a start; it must be one that the history had, at the last acknowledged change or later.
fn assert_kept(disk: &SimulatedDisk, history: &History, what: &str) -> u64 {
    let opened = match open(disk) {
        Ok(opened) => opened,
        Err(error) => panic!("{what}: {error}"),
    };
    let Some(OpenedMap { map, .. }) = opened else {
        assert_eq!(history.acknowledged, None, "{what}: the map is gone");
        return 0;
    };
    let contents = map.contents();
    assert!(Some(contents.revision) >= history.acknowledged, "{what}: {} is left", contents.revision);
    assert!(contents == history.states[contents.revision as usize], "{what}: another map");
    contents.revision
}

/// The files of a map's folder.
fn files(disk: &SimulatedDisk) -> Vec<PathBuf> {
    let maps = Path::new(MAPS);
    let folder = maps.join(&disk.list(maps).unwrap()[0]);
    disk.list(&folder).unwrap().into_iter().map(|name| folder.join(name)).collect()
}

fn is_segment(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "log")
}

#[test]
fn power_that_goes_at_any_moment_loses_nothing_acknowledged() {
    let whole = SimulatedDisk::default();
    let all = run(&whole);
    assert_eq!(all.acknowledged, Some(all.states.len() as u64 - 1));
    let operations = whole.operations();
    assert!(operations > 100, "{operations} operations");
    let mut torn = 0;
    for at in 0..operations {
        let disk = SimulatedDisk::default();
        disk.set_fault(Some(Fault::Crash(at)));
        let history = run(&disk);
        for seed in 0..30 {
            let what = format!("crash at operation {at}, seed {seed}");
            let disk = disk.after_crash(seed);
            let revision = assert_kept(&disk, &history, &what);
            torn += usize::from(open(&disk).unwrap().is_some_and(|again| {
                assert_eq!(again.map.revision(), revision, "{what}: twice started, twice the same");
                again.recovered.cut.is_some()
            }));
            // What was seen after a start is as durable as what was acknowledged.
            let seen = History { acknowledged: history.acknowledged.map(|_| revision), ..history.clone() };
            assert_kept(&disk.after_crash(seed + 1), &seen, &format!("{what}, and again"));
        }
    }
    assert_eq!(torn, 0, "an end that was cut off is not found again");
}

#[test]
fn a_failed_operation_stops_the_journal_and_loses_nothing_acknowledged() {
    let whole = SimulatedDisk::default();
    run(&whole);
    let mut stopped = 0;
    for at in 0..whole.operations() {
        for fault in [Fault::Fails(at), Fault::FallsShort(at)] {
            let disk = SimulatedDisk::default();
            disk.set_fault(Some(fault));
            let history = run(&disk);
            stopped += usize::from(history.stopped);
            let what = format!("{fault:?}");
            disk.set_fault(None);
            assert_kept(&disk.copy(), &history, &what);
            for seed in 0..5 {
                assert_kept(&disk.after_crash(seed), &history, &format!("{what}, then a crash, seed {seed}"));
            }
        }
    }
    assert!(stopped > 20, "the journal stopped {stopped} times");
}

#[test]
fn a_flipped_bit_anywhere_is_harmless_or_refused_by_file_and_offset() {
    let disk = SimulatedDisk::default();
    let history = run(&disk);
    let (mut harmless, mut refused) = (0, 0);
    for path in files(&disk) {
        let bytes = disk.read(&path).unwrap().len();
        for at in 0..bytes {
            let bit = (at * 5 % 8) as u32;
            let damaged = disk.with_flipped_bit(&path, at, bit);
            match open(&damaged) {
                Ok(_) => {
                    let revision = assert_kept(&damaged, &history, &format!("{} byte {at}", path.display()));
                    assert_eq!(Some(revision), history.acknowledged);
                    harmless += 1;
                }
                Err(StoreError::JournalDamaged { path: named, offset, .. }) => {
                    assert!(is_segment(&path) && named == path, "{} byte {at}", path.display());
                    assert!(offset <= at as u64 && at as u64 - offset < 4096, "byte {at}: offset {offset}");
                    refused += 1;
                }
                Err(error) => panic!("{} byte {at}: {error}", path.display()),
            }
        }
    }
    assert!(files(&disk).iter().any(|path| path.extension().is_some_and(|it| it == "part")));
    assert!(harmless > 1000 && refused > 1000, "{harmless} harmless, {refused} refused");
}

#[test]
fn a_refusal_names_the_command_that_helps() {
    let disk = SimulatedDisk::default();
    run(&disk);
    let last = files(&disk).into_iter().rfind(|path| is_segment(path)).unwrap();
    let message = open(&disk.with_flipped_bit(&last, 90, 0)).unwrap_err().to_string();
    assert!(message.contains("damaged at offset 64"), "{message}");
    assert!(message.contains("`mrol doctor data --set-aside office`"), "{message}");
}

#[test]
fn a_folder_of_another_map_is_not_mixed_in() {
    let (disk, other) = (SimulatedDisk::default(), SimulatedDisk::default());
    run(&disk);
    run(&other);
    let last = |disk| files(disk).into_iter().rfind(|path| is_segment(path)).unwrap();
    let foreign = other.read(&last(&other)).unwrap();
    disk.create(&last(&disk)).unwrap().append(&foreign).unwrap();
    let message = open(&disk).unwrap_err().to_string();
    assert!(message.contains("another map's"), "{message}");
}
