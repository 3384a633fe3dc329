//! Reading a map file, or a record of a journal for one voxel, takes no more memory than is asked for, whatever they
//! hold.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod support;

use mrol::geometry::Pose;
use std::sync::Mutex;

use mrol::map::{
    Change, DeletionRecord, MapContents, MapName, MapSettings, MappedScan, RobotName, ScanRecord, Trajectory,
};
use mrol::store::{DataDir, MapFileLimits, Record, Snapshot, StoreSettings, VoxelMention};
use mrol::voxel::{MomentSet, VoxelKey, VoxelSet};
use uuid::Uuid;

use crate::support::hostile_files::hostile_files;
use crate::support::memory::Memory;

/// Held by a test that measures the memory of the process.
static MEASURING: Mutex<()> = Mutex::new(());
const MIB: u64 = 1 << 20;
/// More than that is refused.
const MEMORY_MAX: u64 = 128 * MIB;
/// What the decompressor has for itself, and what an allocator rounds up.
const BESIDES: u64 = 24 * MIB;
const LIMITS: MapFileLimits = MapFileLimits {
    body_bytes_max: 1 << 30,
    voxels_max: 200_000_000,
    scans_max: 20_000_000,
    viewpoint_bytes_max: 256 << 20,
};

/// A map as a server writes it: surfaces, and a long ride.
fn honest_file() -> Vec<u8> {
    let keys = (0..400_000).map(|i| VoxelKey::new([i % 700, i / 700, i / 9000]).unwrap());
    let pose = |i: u64| MappedScan {
        scan_id: Some(i),
        revision: i + 1,
        level_overlaps: vec![0.5; 6],
        ..MappedScan::new(RobotName::new("r1").unwrap(), Pose::translation(i as f64, 0.0, 0.0))
    };
    let contents = MapContents {
        trajectory: Trajectory::new((0..50_000).map(pose), Vec::new()),
        ..MapContents::at(50_000, keys.collect::<VoxelSet>())
    };
    let uuid = Uuid::from_bytes([7; 16]);
    Snapshot { uuid, settings: MapSettings::new(0.05, 6), contents }.encode().unwrap()
}

#[test]
fn what_is_read_takes_no_more_memory_than_was_asked_for() {
    let _measuring = MEASURING.lock().unwrap();
    let memory = Memory::of(std::process::id());
    let files = [vec![("an honest map", honest_file())], hostile_files()].concat();
    for (what, file) in files {
        memory.forget_peak();
        let before = memory.resident() as u64;
        let mut granted = 0;
        let reserve = |bytes| {
            if granted + bytes > MEMORY_MAX {
                return Err(granted + bytes);
            }
            granted += bytes;
            Ok(())
        };
        let read = Snapshot::decode_within(&file, &LIMITS, reserve);
        let taken = (memory.peak() as u64).saturating_sub(before);
        let said = read.as_ref().map_or_else(ToString::to_string, |_| "read".to_owned());
        println!("{what}: {} KiB of {} KiB granted, {said}", taken >> 10, granted >> 10);
        assert!(taken <= granted + BESIDES, "{what} took {taken} bytes, {granted} were granted: {said}");
        assert!(what != "an honest map" || read.is_ok(), "{said}");
    }
}

/// Each in a block of its own: as a set of voxels it takes forty times its record.
fn scattered(count: i32) -> VoxelSet {
    (0..count).filter_map(|i| VoxelKey::new([8 * (i % 1500), 8 * (i / 1500), 0])).collect()
}

#[test]
fn what_a_record_says_of_a_voxel_takes_no_more_memory_than_it_says() {
    let _measuring = MEASURING.lock().unwrap();
    let memory = Memory::of(std::process::id());
    let data = tempfile::tempdir().unwrap();
    let data_dir = DataDir::open(data.path(), StoreSettings::default()).unwrap();
    let contents = MapContents::at(0, VoxelSet::default());
    let first = Snapshot { uuid: Uuid::from_bytes([7; 16]), settings: MapSettings::new(0.05, 6), contents };
    let folder = data_dir.create(&MapName::new("office").unwrap(), &first).unwrap();
    let pose = MappedScan::new(RobotName::new("r1").unwrap(), Pose::identity());
    let insertion = |voxels| {
        let (carved, moments) = (VoxelSet::default(), MomentSet::default());
        Change::Insertion(ScanRecord { pose: pose.clone(), voxels, carved, moments, viewpoint: None })
    };
    let deletion = Change::Deletion(DeletionRecord { voxels: scattered(2_000_000), request: None });
    for change in [insertion(scattered(2_000_000)), deletion, insertion(scattered(10))] {
        folder.append(&[&Record::of(&change).unwrap()]).unwrap();
    }
    folder.sync().unwrap();

    let (voxel, part) = (VoxelKey::new([0; 3]).unwrap(), folder.journal_parts(3)[0]);
    let mut touched = Vec::new();
    for record in folder.records_of_part(&part) {
        let (revision, record) = record.unwrap();
        memory.forget_peak();
        let before = memory.resident() as u64;
        let mention = record.mention(voxel, 0).unwrap();
        // Small pieces may be memory that was given back above, and is taken again unseen; a set of voxels is 144 MB.
        let taken = (memory.peak() as u64).saturating_sub(before);
        println!("revision {revision}: {} KiB of {} KiB", taken >> 10, record.memory_bytes() >> 10);
        assert!(taken <= record.memory_bytes() + 4 * MIB, "{taken} of {} bytes", record.memory_bytes());
        touched.extend(matches!(mention, VoxelMention::Touched(_)).then_some(revision));
    }
    assert_eq!(touched, [1, 3]);
}
