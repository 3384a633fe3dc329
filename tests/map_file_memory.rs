//! Reading a map file takes no more memory than it asks for, whatever the file holds.

#![cfg(all(feature = "server", target_os = "linux"))]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod support;

use mrol::geometry::Pose;
use mrol::map::{MapContents, MapSettings, MappedScan, RobotName, Trajectory};
use mrol::store::{MapFileLimits, Snapshot};
use mrol::voxel::{VoxelKey, VoxelSet};
use uuid::Uuid;

use crate::support::hostile_files::hostile_files;
use crate::support::memory::Memory;

const MIB: u64 = 1 << 20;
/// More than that is refused.
const MEMORY_MAX: u64 = 128 * MIB;
/// What the decompressor has for itself, and what an allocator rounds up.
const BESIDES: u64 = 24 * MIB;
const LIMITS: MapFileLimits =
    MapFileLimits { body_bytes_max: 1 << 30, voxels_max: 200_000_000, scans_max: 20_000_000 };

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
