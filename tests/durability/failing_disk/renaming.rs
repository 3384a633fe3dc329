//! Maps that are renamed on a disk that fails: a map has one of its two names afterwards, and all that was
//! acknowledged.

use mrol::map::MapName;
use mrol::store::{OpeningProgress, Snapshot, StoreError};
use uuid::Uuid;

use super::incarnations::{commit, data_dir, empty, office};
use crate::support::simulated_disk::{Fault, SimulatedDisk};

fn hall() -> MapName {
    MapName::new("hall").unwrap()
}

#[test]
fn a_map_whose_renaming_is_cut_short_has_one_of_the_two_names_and_all_of_its_changes() {
    let (mut kept, mut got) = (0, 0);
    for fault in (0..8).flat_map(|at| [Fault::Fails(at), Fault::Crash(at)]) {
        let disk = SimulatedDisk::default();
        let data = data_dir(&disk);
        let (map, uuid) = (empty(), Uuid::new_v4());
        let folder = data.create(&office(), &Snapshot::of(&map, uuid)).unwrap();
        commit(&folder, &map, 1);
        disk.set_fault(Some(fault));
        let renamed = data.rename(&folder, &hall());
        let is_hall = data.has_name(&folder, &hall());
        assert!(renamed.is_err() || is_hall, "{fault:?}: acknowledged under its former name");
        if matches!(fault, Fault::Fails(_)) {
            // The map goes on, under the name that it has.
            disk.set_fault(None);
            commit(&folder, &map, 2);
        }
        for seed in 0..10 {
            let after = disk.after_crash(seed);
            let again = data_dir(&after);
            let names = again.import_map_files().unwrap().maps;
            let expected = if is_hall { hall() } else { office() };
            match &names[..] {
                [name] if renamed.is_ok() => {
                    assert_eq!(*name, expected, "{fault:?}: what was acknowledged is lost")
                }
                [name] => assert!([office(), hall()].contains(name), "{fault:?}"),
                _ => panic!("{fault:?}: the map has the names {names:?}"),
            }
            (kept, got) = (kept + usize::from(names[0] == office()), got + usize::from(names[0] == hall()));
            let opened = again.map(&names[0], &OpeningProgress::default()).unwrap();
            assert!(opened.uuid == uuid && opened.map.contents() == map.contents(), "{fault:?}: another map");
        }
    }
    assert!(kept > 0 && got > 0, "both are met: {kept} {got}");
}

#[test]
fn a_name_that_a_folder_has_is_refused_and_both_maps_stay() {
    let disk = SimulatedDisk::default();
    let data = data_dir(&disk);
    let folder = data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    data.create(&hall(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
    for taken in [hall(), office()] {
        let refused = data.rename(&folder, &taken).unwrap_err();
        assert!(refused.to_string().contains(&format!("map {taken} exists")), "{refused}");
    }
    assert_eq!(data.names().unwrap(), [hall(), office()]);
    data.remove(&folder).unwrap();
    assert!(matches!(data.rename(&folder, &MapName::new("new").unwrap()), Err(StoreError::Gone)));
}

#[test]
fn a_map_that_gets_the_name_back_that_another_took_keeps_it_at_the_next_start() {
    let whole = SimulatedDisk::default();
    let replace = |disk: &SimulatedDisk, fault| {
        let data = data_dir(disk);
        let old = data.create(&office(), &Snapshot::of(&empty(), Uuid::new_v4())).unwrap();
        disk.set_fault(fault);
        let replaced = data.replace(&office(), &old, &hall(), &Snapshot::of(&empty(), Uuid::new_v4()));
        (data, old, replaced)
    };
    drop(replace(&whole, None));
    let mut left = 0;
    for at in 0..whole.operations() {
        let disk = SimulatedDisk::default();
        let (data, old, Ok(new)) = replace(&disk, Some(Fault::Fails(at))) else { continue };
        disk.set_fault(None);
        left += 1;
        let moved = MapName::new("moved").unwrap();
        data.rename(&new, &moved).unwrap();
        data.rename(&old, &office()).unwrap();
        let names = data_dir(&disk.copy()).import_map_files().unwrap().maps;
        assert_eq!(names, [moved, office()], "failed at {at}");
    }
    assert!(left > 0, "no failure left the file that says who is replaced");
}
