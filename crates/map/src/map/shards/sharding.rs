//! Which shard a voxel belongs to.

use super::bounds::{Bounds, bounds};
use crate::geometry::{Point, Pose};
use crate::voxel::Lattice;

/// Number of shards of a map; a power of two, so that the SIMD kernels keep all descriptors in registers.
pub const SHARDS: usize = 16;

/// Side of a region is at least 2^6 = 64 voxels: a scan then touches few shards, and a block lies in one.
const REGION_SHIFT_MIN: u32 = 6;

/// Space cut into cubic regions, each of one shard.
///
/// A region is at least as large as a coarsest voxel, so that parents share their children's shard. Shards are
/// dealt out as colors, (x + z + 4 (y + z)) mod 16 of the region's indices: neighbors never share a lock,
/// any 4 x 4 regions of a horizontal plane lie in 16 shards, and the SIMD kernels need no multiplication.
#[derive(Debug, Clone, Copy)]
pub(in crate::map) struct Sharding {
    region_shift: u32,
}

/// The shards that something needs, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::map) struct ShardsTouched(u32);

impl ShardsTouched {
    pub(in crate::map) fn all() -> Self {
        Self((1 << SHARDS) - 1)
    }

    pub(super) fn none() -> Self {
        Self(0)
    }

    pub(super) fn add(&mut self, shard: usize) {
        self.0 |= 1 << shard;
    }

    pub(in crate::map) fn contains(self, shard: usize) -> bool {
        self.0 >> shard & 1 == 1
    }
}

/// How far f32 arithmetic may move a point, as a fraction of the coordinates that entered it.
const ROUNDING: f64 = 1e-5;

/// Points that are looked at before all are.
const FEW_POINTS: usize = 64;

/// Shards from which on a view covers all of them: to spare the others their locks, all points would have to be looked
/// at, which takes a tenth of what a look-up by the filter does.
const MANY_SHARDS: u32 = SHARDS as u32 / 2;

impl Sharding {
    pub(in crate::map) fn new(levels: u32) -> Self {
        Self { region_shift: REGION_SHIFT_MIN.max(levels - 1) }
    }

    /// How many levels a voxel of `level` lies below a region.
    pub(in crate::map) fn shift_at(self, level: u32) -> u32 {
        self.region_shift - level
    }

    /// The shard of the voxel at `index` of `level`, at most the region's own.
    pub(in crate::map) fn shard_of(self, index: [i32; 3], level: u32) -> usize {
        shard_of_region(index.map(|i| i >> self.shift_at(level)))
    }

    /// The shard of the voxel at `index` of `level`; none where the level is so coarse that the voxel spans several
    /// regions.
    pub(in crate::map) fn shard_of_node(self, index: [i32; 3], level: u32) -> Option<usize> {
        (level <= self.region_shift).then(|| self.shard_of(index, level))
    }

    /// Shards enough for `points` placed at `map_from_points`: those of the regions that their bounding box meets, with
    /// room for rounding; all of them where that is many.
    pub(in crate::map) fn touched_by(
        self,
        points: &[Point],
        map_from_points: &Pose,
        lattice: &Lattice,
    ) -> ShardsTouched {
        // A scan needs many shards more often than not, and a few of its points tell.
        let few: Vec<Point> = points.iter().step_by(points.len() / FEW_POINTS + 1).copied().collect();
        let touched_in = |bounds: Bounds| touched_in(self.regions(bounds, map_from_points, lattice));
        match bounds(&few).map(touched_in) {
            Some(touched) if touched.0.count_ones() >= MANY_SHARDS => ShardsTouched::all(),
            _ => bounds(points).map_or(ShardsTouched::none(), touched_in),
        }
    }

    /// The inclusive ranges of regions that a box of points placed at `map_from_points` meets.
    fn regions(self, (min, max): Bounds, map_from_points: &Pose, lattice: &Lattice) -> [(i64, i64); 3] {
        let rotation = map_from_points.rotation.to_rotation_matrix();
        std::array::from_fn(|row| {
            let translation = map_from_points.translation.vector[row];
            let (mut low, mut high, mut size) = (translation, translation, translation.abs());
            for column in 0..3 {
                let r = rotation[(row, column)];
                let (a, b) = (r * f64::from(min[column]), r * f64::from(max[column]));
                low += a.min(b);
                high += a.max(b);
                size += a.abs().max(b.abs());
            }
            let margin = lattice.resolution_m(0) + size * ROUNDING;
            let region_m = lattice.resolution_m(0) * (1u64 << self.region_shift) as f64;
            (((low - margin) / region_m).floor() as i64, ((high + margin) / region_m).floor() as i64)
        })
    }
}

/// The shards of all regions with indices in the inclusive ranges.
fn touched_in(ranges: [(i64, i64); 3]) -> ShardsTouched {
    // Sixteen regions in a row meet every shard that more of them would.
    let span = |(low, high): (i64, i64)| low..=high.min(low.saturating_add(SHARDS as i64 - 1));
    let mut touched = ShardsTouched::none();
    for z in span(ranges[2]) {
        for y in span(ranges[1]) {
            for x in span(ranges[0]) {
                touched.add(shard_of_region([x as i32, y as i32, z as i32]));
            }
            if touched == ShardsTouched::all() {
                return touched;
            }
        }
    }
    touched
}

#[inline(always)]
pub(in crate::map) fn shard_of_region([x, y, z]: [i32; 3]) -> usize {
    let color = x.wrapping_add(z).wrapping_add(y.wrapping_add(z) << 2);
    color as usize & (SHARDS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn neighboring_regions_never_share_a_shard() {
        for d in [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, -1, 0], [0, 1, -1]] {
            assert_ne!(shard_of_region([0; 3]), shard_of_region(d), "{d:?}");
        }
        let plane: std::collections::BTreeSet<_> =
            (0..4).flat_map(|x| (0..4).map(move |y| shard_of_region([x, y, 0]))).collect();
        assert_eq!(plane.len(), SHARDS);
    }

    proptest! {
        #[test]
        fn every_point_falls_in_a_shard_that_was_foreseen(
            points in prop::collection::vec(prop::array::uniform3(-3000f32..3000.0), 1..50),
            spread in 0.001f32..1.0,
            translation in prop::array::uniform3(-20_000f64..20_000.0),
            angles in prop::array::uniform3(-3.0f64..3.0),
            levels in 1u32..=12,
        ) {
            let points: Vec<Point> = points.iter().map(|p| Point::from(p.map(|c| c * spread))).collect();
            let pose = Pose::new(translation.into(), nalgebra::Vector3::from(angles));
            let lattice = Lattice::new(0.05, levels).unwrap();
            let sharding = Sharding::new(levels);
            let touched = sharding.touched_by(&points, &pose, &lattice);
            let quantize = lattice.from_points(&pose);
            for point in points {
                if let Some(index) = quantize.index(point) {
                    prop_assert!(touched.contains(sharding.shard_of(index, 0)));
                }
            }
        }
    }
}
