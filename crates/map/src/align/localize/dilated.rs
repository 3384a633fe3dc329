//! Dilated levels that a search reads: those of one revision of the map, and coarser ones where they are needed.

use super::answer::LocalizationError;
use super::distance_field::DistanceField;
use super::query::SearchBox;
use super::sample::SearchSample;
use super::settings::LocalizationSettings;
use super::slabs::{BLOCKS_PER_STOP_CHECK, Slabs, VoxelBox};
use super::supervision::{Supervision, Unbuilt, check};
use crate::geometry::translation_m;
use crate::map::{ContentVersion, MultiResolutionMap};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BlockMask, VoxelKey};

/// Distance fields of a part of the map at several levels, finest first, each twice as coarse as the one before.
#[derive(Debug)]
pub(super) struct DilatedLevels {
    fields: Vec<DistanceField>,
    /// Box in which the sensor is searched for.
    pub(super) domain: SearchBox,
    /// The version of the map that the levels were taken from.
    pub(super) version: ContentVersion,
}

/// Voxels along the side of a cell in the field that it reads, where there is a field as fine: rounding up to whole
/// voxels then costs little.
const VOXELS_PER_CELL: u32 = 4;
/// Share of a map's voxels that may be strays at each end of each axis: seen through windows, or not there.
const STRAY_SHARE: f64 = 1e-3;
/// Fewest search voxels within the scan's range that a search works with.
const RESOLUTIONS_PER_RANGE_MIN: f64 = 8.0;
/// Level at which a whole map is one voxel.
const LEVEL_MAX: f64 = 20.0;
/// Number of temporary grids, one byte a voxel, that exist while a field is built.
const GRIDS_BESIDE: usize = 2;
/// Poses of a trajectory between two checks of the stop signal.
const POSES_PER_STOP_CHECK: usize = 16 << 10;

/// Blocks of one revision of a map, in no particular order.
struct Blocks {
    blocks: Vec<(VoxelKey, BlockMask)>,
    version: ContentVersion,
}

impl Blocks {
    /// Copies the blocks of the map. Commits wait meanwhile; readers do not.
    fn of(map: &MultiResolutionMap, supervision: &mut Supervision<'_>) -> Result<Self, Unbuilt> {
        let count = map.view().lists(0).map(|list| list.blocks().len()).sum::<usize>();
        supervision.take(count * size_of::<(VoxelKey, BlockMask)>())?;
        let (read, stop) = (map.long_read(), supervision.stop);
        let view = read.view();
        let mut blocks = Vec::with_capacity(count);
        for (block, mask) in view.lists(0).flat_map(|list| list.blocks().iter()) {
            if blocks.len().is_multiple_of(BLOCKS_PER_STOP_CHECK) {
                check(stop)?;
            }
            blocks.push((block, *mask));
        }
        Ok(Self { blocks, version: view.version() })
    }

    /// Calls `f` with the voxels of `level` within a box of finest voxels. A coarse voxel comes once for each block
    /// that it has.
    fn for_each_voxel(
        &self,
        level: u32,
        (low, high): VoxelBox,
        stop: StopSignal<'_>,
        mut f: impl FnMut(VoxelKey),
    ) -> Result<(), Unbuilt> {
        let in_block = level.min(BLOCK_LEVELS - 1);
        let is_inside = |key: &VoxelKey| {
            let index = key.index();
            (0..3).all(|axis| (low[axis] >> level..=high[axis] >> level).contains(&index[axis]))
        };
        for blocks in self.blocks.chunks(BLOCKS_PER_STOP_CHECK) {
            check(stop)?;
            for (block, mask) in blocks {
                let voxels = mask.cells(in_block).map(|cell| cell.voxel(*block).ancestor(level));
                voxels.filter(is_inside).for_each(&mut f);
            }
        }
        Ok(())
    }
}

impl DilatedLevels {
    /// The levels that the points of `sample` can fall on from within `search_box`; without a box, from within the bulk
    /// of the map and around its trajectory.
    ///
    /// # Errors
    /// When the map has no voxel there, or too many for [`LocalizationSettings::grid_bytes_max`]; when there is no
    /// memory for them, or they were stopped.
    pub(super) fn of(
        map: &MultiResolutionMap,
        sample: &SearchSample,
        search_box: Option<SearchBox>,
        settings: &LocalizationSettings,
        supervision: &mut Supervision<'_>,
    ) -> Result<Self, Unbuilt> {
        let stop = supervision.stop;
        let blocks = Blocks::of(map, supervision)?;
        if blocks.blocks.is_empty() {
            return Err(LocalizationError::EmptyMap.into());
        }
        let slabs = Slabs::of(&blocks.blocks, stop)?;
        let resolution_m = |level: u32| map.settings().resolution_m * f64::from(1u32 << level);
        let all = slabs.bounds(0.0).ok_or(LocalizationError::EmptyMap)?;
        let range_m = sample.range_max_m();
        let nothing_there = LocalizationError::NothingThere { range_m };
        let box_of = |(low, high): VoxelBox| SearchBox::of_voxels(low, high, resolution_m(0));
        let (seen, domain) = match search_box {
            Some(given) => (meet(all, given.grown(range_m), resolution_m(0)), given),
            None => {
                let bulk = slabs.bounds(STRAY_SHARE).unwrap_or(all);
                (Some(bulk), around_trajectory(map, box_of(bulk), stop)?)
            }
        };
        let seen = seen.ok_or(nothing_there.clone())?;
        // From farther away too little of the map is visible, so the box is finite whatever was given.
        let sight_m = sample.sight_m(settings.search_overlap_min) + resolution_m(1);
        let domain = domain.meet(box_of(seen).grown(sight_m)).ok_or(nothing_there.clone())?;
        let level = finest_level(seen, sample.range_m, resolution_m(0), settings)?;
        supervision.take(grid_bytes(seen, level, settings))?;
        let mut fields = Vec::new();
        for up in 0..fields_of(settings) {
            let [low, high] = [seen.0, seen.1].map(|i| i.map(|i| i >> (level + up)));
            let mut field = DistanceField::empty(low, high, resolution_m(level + up), stop)?;
            let mut is_empty = true;
            blocks.for_each_voxel(level, seen, stop, |voxel| {
                is_empty = false;
                field.occupy(voxel.ancestor(up));
            })?;
            if is_empty {
                return Err(nothing_there.into());
            }
            field.spread(stop)?;
            fields.push(field);
        }
        Ok(Self { fields, domain, version: blocks.version })
    }

    /// The levels without a search box or supervision.
    #[cfg(test)]
    pub(super) fn of_all(
        map: &MultiResolutionMap,
        sample: &SearchSample,
        settings: &LocalizationSettings,
    ) -> Self {
        let alone = &mut Supervision {
            stop: StopSignal::NEVER,
            search_stop: StopSignal::NEVER,
            progress: &mut |_| (),
            reserve: &mut |_| true,
        };
        Self::of(map, sample, None, settings, alone).unwrap()
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

/// `bulk` and all of the map's poses.
fn around_trajectory(
    map: &MultiResolutionMap,
    bulk: SearchBox,
    stop: StopSignal<'_>,
) -> Result<SearchBox, Unbuilt> {
    let trajectory = map.trajectory().clone();
    let mut around = bulk;
    for (i, pose) in trajectory.poses().enumerate() {
        if i.is_multiple_of(POSES_PER_STOP_CHECK) {
            check(stop)?;
        }
        around = around.holding(translation_m(&pose.map_from_sensor));
    }
    Ok(around)
}

/// Number of fields that the cells of a search read.
fn fields_of(settings: &LocalizationSettings) -> u32 {
    1 + settings.halvings.saturating_sub(VOXELS_PER_CELL.ilog2())
}

/// Bytes that the fields take from `level` on, with what is there while the first and largest is built.
fn grid_bytes(seen: VoxelBox, level: u32, settings: &LocalizationSettings) -> usize {
    let of_field = |up: u32| {
        let [low, high] = [seen.0, seen.1].map(|i| i.map(|i| i >> (level + up)));
        DistanceField::grid(low, high).iter().fold(1usize, |bytes, &side| bytes.saturating_mul(side))
    };
    let beside = of_field(0).saturating_mul(GRIDS_BESIDE);
    (0..fields_of(settings)).fold(beside, |bytes, up| bytes.saturating_add(of_field(up)))
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
    let bytes = |level: u32| grid_bytes(seen, level, settings);
    let (coarsest, bytes_max) = (coarsest.max(needed), settings.grid_bytes_max);
    (needed..=coarsest).find(|&level| bytes(level) <= bytes_max).ok_or_else(|| LocalizationError::TooLarge {
        bytes: bytes(coarsest),
        resolution_m: resolution_m * f64::from(1u32 << coarsest),
        bytes_max,
    })
}

/// The part of `all` that lies in `region`.
fn meet(all: VoxelBox, region: SearchBox, resolution_m: f64) -> Option<VoxelBox> {
    let voxel = |c: f64| (c / resolution_m).floor().clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32;
    let low = std::array::from_fn(|axis| all.0[axis].max(voxel(region.min_m()[axis])));
    let high = std::array::from_fn(|axis| all.1[axis].min(voxel(region.max_m()[axis])));
    (0..3).all(|axis| low[axis] <= high[axis]).then_some((low, high))
}
