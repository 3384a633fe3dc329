//! A data folder that is taken out of its cluster on a disk that fails: each map is there once afterwards, as it was,
//! and the folder belongs to the node until all of them have uuids of their own.

use mrol::map::MapContents;
use mrol::store::OpeningProgress;
use uuid::Uuid;

use super::incarnations::{data_dir, office};
use super::workload::run;
use crate::support::simulated_disk::{Fault, SimulatedDisk};

/// The folder of a node, with a map; the uuid and the contents of that.
fn of_node() -> (SimulatedDisk, Uuid, MapContents) {
    let disk = SimulatedDisk::default();
    run(&disk);
    data_dir(&disk).set_node("n1").unwrap();
    let (uuid, contents) = only_map(&disk, "before");
    (disk, uuid, contents)
}

/// The one map of a folder, as the next start finds it.
fn only_map(disk: &SimulatedDisk, what: &str) -> (Uuid, MapContents) {
    let data = data_dir(disk);
    let found = data.import_map_files().unwrap();
    assert!(found.refused.is_empty() && found.maps == [office()], "{what}: {found:?}");
    let opened = data.map(&office(), &OpeningProgress::default());
    let opened = opened.unwrap_or_else(|error| panic!("{what}: {error}"));
    (opened.uuid, opened.map.contents())
}

#[test]
fn a_map_that_leaves_is_another_incarnation_with_all_that_it_had() {
    let (disk, before, contents) = of_node();
    let mut left = Vec::new();
    assert_eq!(data_dir(&disk).leave_cluster(|map| left.push(map.clone())).unwrap().as_deref(), Some("n1"));
    let (now, after) = only_map(&disk, "after");
    let [map] = &left[..] else { panic!("{left:?}") };
    assert_eq!((&map.name, map.revision), (&office(), contents.revision));
    assert_eq!((map.before, map.now), (before, now));
    assert!(now != before && after == contents, "another map");
    // Of a folder that belongs to no node nothing is changed.
    assert_eq!(data_dir(&disk).leave_cluster(|map| panic!("{map:?}")).unwrap(), None);
    assert_eq!(only_map(&disk, "again").0, now);
    assert_eq!(
        data_dir(&disk).not_understood().unwrap().len() + data_dir(&disk).set_aside().unwrap().len(),
        0
    );
}

#[test]
fn a_folder_that_was_cut_short_belongs_to_the_node_and_leaves_at_the_next_attempt() {
    let (whole, before, contents) = of_node();
    let disk = whole.copy();
    disk.set_fault(None);
    data_dir(&disk).leave_cluster(|_| {}).unwrap();
    let operations = disk.operations();
    let (mut old, mut new) = (0, 0);
    for fault in (0..operations).flat_map(|at| [Fault::Fails(at), Fault::Crash(at)]) {
        let disk = whole.copy();
        disk.set_fault(Some(fault));
        let outcome = data_dir(&disk).leave_cluster(|_| {});
        for seed in 0..6 {
            let what = format!("{fault:?}, seed {seed}");
            let disk = disk.after_crash(seed);
            // Where the mark is gone, so is the uuid that the cluster knows.
            let is_marked = data_dir(&disk).node().unwrap().is_some();
            assert!(!is_marked || outcome.is_err(), "{what}: what was acknowledged is lost");
            let (uuid, found) = only_map(&disk, &what);
            assert!(found == contents, "{what}: another map");
            assert!(is_marked || uuid != before, "{what}: it has left with the uuid of the cluster's");
            (old, new) = (old + usize::from(uuid == before), new + usize::from(uuid != before));
            data_dir(&disk).leave_cluster(|_| {}).unwrap();
            assert_eq!(data_dir(&disk).node().unwrap(), None, "{what}");
            let (uuid, found) = only_map(&disk.after_crash(seed), &what);
            assert!(uuid != before && found == contents, "{what}: another map");
        }
    }
    assert!(old > 0 && new > 0, "both are met: {old} {new}");
}
