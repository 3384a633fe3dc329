//! The levels that a search reads: those of one revision of the map, dilated, and coarser ones where needed.

use super::field::DistanceField;
use super::sample::SearchSample;
use super::{LocalizationError, LocalizationSettings, SearchBox};
use crate::geometry::translation_m;
use crate::map::{MultiResolutionMap, TrajectoryPose};
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, VoxelKey, VoxelSet};

/// Distance fields of a part of the map at several levels, finest first, each twice as coarse as the one before.
#[derive(Debug)]
pub(super) struct DilatedLevels {
    fields: Vec<DistanceField>,
    /// The occupied voxels of the finest field.
    pub(super) voxels: Vec<VoxelKey>,
    /// Where the sensor is searched.
    pub(super) domain: SearchBox,
    /// Of the map that they were taken from.
    pub(super) revision: u64,
}

/// Voxels along a cell in the field that it reads, if there is one as fine: rounding up to whole voxels then costs
/// little.
const VOXELS_PER_CELL: u32 = 4;
/// Share of a map's voxels that may be strays at each end of each axis: seen through windows, or not there.
const STRAY_SHARE: f64 = 1e-3;
/// Search voxels within the scan's range that a search cannot do without.
const RESOLUTIONS_PER_RANGE_MIN: f64 = 8.0;
/// Levels beyond which a whole map is a voxel.
const LEVEL_MAX: f64 = 20.0;
/// What building a field takes besides it: two of the same size.
const BYTES_PER_VOXEL: usize = 3;

/// A box of finest voxels, inclusive.
type VoxelBox = ([i32; 3], [i32; 3]);

impl DilatedLevels {
    /// The levels that `sample` can show from within `search_box`; without one, from within the bulk of the map and
    /// around its trajectory.
    ///
    /// # Errors
    /// When the map has no voxel there, or too many for [`LocalizationSettings::grid_bytes_max`].
    pub(super) fn of(
        map: &MultiResolutionMap,
        sample: &SearchSample,
        search_box: Option<SearchBox>,
        settings: &LocalizationSettings,
    ) -> Result<Self, LocalizationError> {
        let view = map.view();
        let (voxels, revision) = (view.voxels(), view.revision());
        let station = |pose: &TrajectoryPose| translation_m(&pose.map_from_sensor);
        let stations: Vec<[f64; 3]> = map.trajectory().poses().map(station).collect();
        drop(view);
        let resolution_m = |level: u32| map.settings().resolution_m * f64::from(1u32 << level);
        let all = bounds(&voxels, 0.0).ok_or(LocalizationError::EmptyMap)?;
        let range_m = sample.range_max_m();
        let nothing_there = LocalizationError::NothingThere { range_m };
        let box_of = |(low, high): VoxelBox| SearchBox::of_voxels(low, high, resolution_m(0));
        let (seen, domain) = match search_box {
            Some(given) => (meet(all, given.grown(range_m), resolution_m(0)), given),
            None => {
                let bulk = bounds(&voxels, STRAY_SHARE).unwrap_or(all);
                (Some(bulk), stations.into_iter().fold(box_of(bulk), SearchBox::holding))
            }
        };
        let seen = seen.ok_or(nothing_there.clone())?;
        // From further away nothing is in sight.
        let domain = domain.meet(box_of(seen).grown(range_m)).ok_or(nothing_there.clone())?;
        let level = finest_level(seen, sample.range_m, resolution_m(0), settings)?;
        let occupied = ancestors(&voxels, seen, level);
        if occupied.is_empty() {
            return Err(nothing_there);
        }
        let field = |up: u32| {
            let ([low, high], voxels) =
                ([seen.0, seen.1].map(|i| i.map(|i| i >> (level + up))), occupied.iter());
            DistanceField::new(voxels.map(|key| key.ancestor(up)), low, high, resolution_m(level + up))
        };
        let fields = 1 + settings.halvings.saturating_sub(VOXELS_PER_CELL.ilog2());
        Ok(Self { fields: (0..fields).map(field).collect(), voxels: occupied, domain, revision })
    }

    /// The finest field.
    pub(super) fn finest(&self) -> &DistanceField {
        &self.fields[0]
    }

    /// The field that cells of `depth` read.
    pub(super) fn at(&self, depth: u32) -> &DistanceField {
        let field = depth.saturating_sub(VOXELS_PER_CELL.ilog2()) as usize;
        &self.fields[field.min(self.fields.len() - 1)]
    }
}

/// The finest level that the search needs, or the one after it that fits the memory.
fn finest_level(
    seen: VoxelBox,
    range_m: f64,
    resolution_m: f64,
    settings: &LocalizationSettings,
) -> Result<u32, LocalizationError> {
    let wish_m = range_m / settings.resolutions_per_range;
    let needed = (wish_m / resolution_m).log2().round().clamp(0.0, LEVEL_MAX) as u32;
    let coarsest =
        (range_m / RESOLUTIONS_PER_RANGE_MIN / resolution_m).log2().floor().clamp(0.0, LEVEL_MAX) as u32;
    let bytes = |level: u32| {
        let grid = DistanceField::grid(seen.0.map(|i| i >> level), seen.1.map(|i| i >> level));
        grid.iter().fold(BYTES_PER_VOXEL, |bytes, &side| bytes.saturating_mul(side))
    };
    let (coarsest, bytes_max) = (coarsest.max(needed), settings.grid_bytes_max);
    (needed..=coarsest).find(|&level| bytes(level) <= bytes_max).ok_or_else(|| LocalizationError::TooLarge {
        bytes: bytes(coarsest),
        resolution_m: resolution_m * f64::from(1u32 << coarsest),
        bytes_max,
    })
}

/// The box that holds all blocks of the set but a `stray` share of the voxels at each end of each axis.
fn bounds(voxels: &VoxelSet, stray: f64) -> Option<VoxelBox> {
    let mut low = [0; 3];
    let mut high = [0; 3];
    for axis in 0..3 {
        let place = |(block, mask): &(VoxelKey, BlockMask)| (block.index()[axis], mask.count(0));
        let mut slabs: Vec<(i32, usize)> = voxels.blocks().iter().map(place).collect();
        slabs.sort_unstable();
        let strays = (voxels.len() as f64 * stray) as usize;
        low[axis] = first_beyond(strays, slabs.iter())? << BLOCK_LEVELS;
        high[axis] = (first_beyond(strays, slabs.iter().rev())? << BLOCK_LEVELS) + BLOCK_SIDE - 1;
    }
    Some((low, high))
}

/// The slab in which more than `strays` voxels have been passed.
fn first_beyond<'a>(strays: usize, mut slabs: impl Iterator<Item = &'a (i32, usize)>) -> Option<i32> {
    let mut passed = 0;
    let beyond = |(_, count): &&(i32, usize)| {
        passed += count;
        passed > strays
    };
    slabs.find(beyond).map(|(slab, _)| *slab)
}

/// The part of `all` that lies in `region`.
fn meet(all: VoxelBox, region: SearchBox, resolution_m: f64) -> Option<VoxelBox> {
    let voxel = |c: f64| (c / resolution_m).floor().clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32;
    let low = std::array::from_fn(|axis| all.0[axis].max(voxel(region.min_m()[axis])));
    let high = std::array::from_fn(|axis| all.1[axis].min(voxel(region.max_m()[axis])));
    (0..3).all(|axis| low[axis] <= high[axis]).then_some((low, high))
}

/// The distinct ancestors of the set's voxels within a box of finest voxels, `level` levels up.
fn ancestors(voxels: &VoxelSet, (low, high): VoxelBox, level: u32) -> Vec<VoxelKey> {
    let in_block = level.min(BLOCK_LEVELS - 1);
    let inside = |key: &VoxelKey| {
        let index = key.index();
        (0..3).all(|axis| (low[axis] >> level..=high[axis] >> level).contains(&index[axis]))
    };
    let of_block = |(block, mask): &(VoxelKey, BlockMask)| {
        let block = *block;
        mask.cells(in_block).map(move |cell| cell.voxel(block).ancestor(level))
    };
    let mut ancestors: Vec<VoxelKey> = voxels.blocks().iter().flat_map(of_block).filter(inside).collect();
    ancestors.sort_unstable();
    ancestors.dedup();
    ancestors
}
