//! Random maps and points for the tests of this folder.

use proptest::prelude::*;

use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use crate::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey, VoxelSet};

/// Side of a finest voxel, meters.
pub(in crate::planning) const RESOLUTION_M: f64 = 0.5;

/// Indices about the origin, and on both sides of the border of a region.
fn index() -> impl Strategy<Value = i32> {
    prop_oneof![5 => -24i32..24, 1 => 56i32..72, 1 => -72i32..-56]
}

/// Indices of a voxel; now and then of one where indices end.
fn voxel() -> impl Strategy<Value = [i32; 3]> {
    let ends = || prop::sample::select(vec![INDEX_MIN, INDEX_MIN + 1, 0, INDEX_MAX - 1, INDEX_MAX]);
    prop_oneof![600 => prop::array::uniform3(index()), 1 => prop::array::uniform3(ends())]
}

fn voxels(most: usize) -> impl Strategy<Value = VoxelSet> {
    let one = voxel().prop_map(VoxelKey::pack);
    // A wall too: a block with one voxel is not all there is.
    let wall = (prop::array::uniform3(index()), 0usize..3).prop_map(|(first, across)| {
        let side = move |n: i32| [n % 12, n / 12];
        let at = move |n: i32| {
            let mut index = first;
            index[(across + 1) % 3] += side(n)[0];
            index[(across + 2) % 3] += side(n)[1];
            index.map(|i| i.clamp(INDEX_MIN, INDEX_MAX))
        };
        (0..144).filter_map(|n| VoxelKey::new(at(n))).collect::<Vec<_>>()
    });
    (prop::collection::vec(one, 0..most), prop::collection::vec(wall, 0..3))
        .prop_map(|(some, walls)| some.into_iter().chain(walls.into_iter().flatten()).collect())
}

/// A map that is yet to be made: some voxels, of which some are deleted again.
#[derive(Debug, Clone)]
pub(in crate::planning) struct History {
    levels: u32,
    inserted: VoxelSet,
    deleted: VoxelSet,
}

impl History {
    /// The map of this history.
    pub(in crate::planning) fn map(&self) -> MultiResolutionMap {
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, self.levels)).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        map.committer().insert_scan(ScanRecord::of_voxels(pose, self.inserted.clone()));
        map.committer().remove(&self.deleted);
        map
    }
}

/// A history of a map of 1 to 8 levels, and a level of it.
pub(in crate::planning) fn history_and_level() -> impl Strategy<Value = (History, u32)> {
    let level = (1u32..=8).prop_flat_map(|levels| (Just(levels), 0..levels));
    (level, voxels(60), voxels(20)).prop_map(|((levels, level), kept, deleted)| {
        let inserted = kept.iter().chain(deleted.iter()).collect();
        (History { levels, inserted, deleted }, level)
    })
}

/// Coordinates of points among the voxels, meters: many on borders and centers of voxels.
pub(super) fn coordinate() -> impl Strategy<Value = f32> {
    let border = (f64::from(INDEX_MAX) + 1.0) * RESOLUTION_M;
    prop_oneof![
        8 => (-60i32..60).prop_map(|quarters| quarters as f32 * 0.125 * 2.0),
        8 => -20.0f32..20.0,
        2 => -40.0f32..40.0,
        1 => prop::sample::select(vec![-border as f32, border as f32 - 0.25, -0.0, 1e-30, -1e-30]),
    ]
}

/// A point among the voxels.
pub(in crate::planning) fn point() -> impl Strategy<Value = Point> {
    prop::array::uniform3(coordinate()).prop_map(Point::from)
}
