//! The changes of histories: each has a voxel of its own, by which it is known.

use std::sync::Arc;

use crate::commit::scan_turn::TurnLimits;
use crate::commit::submission::{Prepared, Submission, record_of};
use crate::limits::Marks;
use crate::resources::ResourceBudget;
use mrol_map::geometry::Pose;
use mrol_map::map::{Change, MapName, MapSettings, MappedScan, RobotName, ScanRecord};
use mrol_map::voxel::{VoxelKey, VoxelSet};
use uuid::Uuid;

pub(super) const MAP: Uuid = Uuid::from_u128(7);

pub(super) fn settings() -> MapSettings {
    MapSettings { filter: None, moments: false, ..MapSettings::new(1.0, 1) }
}

pub(super) fn name() -> MapName {
    MapName::new("shared").unwrap()
}

pub(super) fn marker(change: i32) -> VoxelKey {
    VoxelKey::new([change, 0, 0]).unwrap()
}

/// A change with a voxel of its own, and others where it is large.
pub(super) fn change_of(number: i32, is_large: bool) -> Change {
    let others = (0..if is_large { 900 } else { 3 })
        .filter_map(|i| VoxelKey::new([number, 1 + i * i % 97, i * 7 % 211]));
    let voxels: VoxelSet = std::iter::once(marker(number)).chain(others).collect();
    let pose = MappedScan::new(RobotName::new("robot").unwrap(), Pose::identity());
    Change::Insertion(ScanRecord::of_voxels(pose, voxels))
}

/// A change that was decided on now.
pub(super) fn prepared(change: Change) -> Submission {
    prepared_at(u64::MAX, change)
}

/// A change that was decided on at a revision.
pub(super) fn prepared_at(seen: u64, change: Change) -> Submission {
    let robot_lock = Arc::new(tokio::sync::Mutex::new(())).try_lock_owned().unwrap();
    Submission::Prepared(Box::new(Prepared {
        record: Some(record_of(&change).unwrap()),
        change,
        seen,
        if_empty: false,
        limits: TurnLimits { carved_at: 0, viewpoint_bytes_max: 0 },
        robot_lock: Arc::new(robot_lock),
        reservation: ResourceBudget::new(None, Marks::default()).reserve(0).unwrap(),
    }))
}
