//! Voxels of a level by a [`VoxelSelection`]: the walk over the stored blocks that can hold one.

use crate::map::regions::{Region, VoxelSelection};
use crate::map::shards::{OccupiedVoxelList, tier_of};
use crate::map::view::MapView;
use crate::util::StopSignal;
use crate::voxel::{BLOCK_SIDE, BLOCKS_PER_STOP_CHECK, BlockMask, INDEX_MAX, INDEX_MIN, VoxelKey, VoxelSet};

impl MapView<'_> {
    /// The finest voxels at and below the voxels of `level` whose centers lie in `region`.
    ///
    /// Takes some 72 bytes a block of finest voxels, and no more for a voxel.
    pub fn finest_in(&self, region: &Region, level: u32) -> VoxelSet {
        self.finest_in_until(region, level, StopSignal::NEVER)
    }

    /// [`MapView::finest_in`] under a stop signal; once stopped, some of the voxels.
    pub fn finest_in_until(&self, region: &Region, level: u32, stop: StopSignal<'_>) -> VoxelSet {
        let (tier, _) = tier_of(level);
        let selection = VoxelSelection::from(Some(*region));
        let mut found = Vec::new();
        for shard in self.shards() {
            let mut blocks = Vec::new();
            self.for_each_block(&shard.level(level), &selection, stop, |block, mask| {
                let wanted = self.part_in(&selection, level, block, mask);
                if !wanted.is_empty() {
                    blocks.push((block, wanted));
                }
            });
            if stop.is_stopped() {
                break;
            }
            found.extend_from_slice(shard.descendants(tier, &blocks).blocks());
        }
        VoxelSet::of_blocks_until(found, stop)
    }

    /// The voxels of `level` whose centers lie in `region`.
    pub fn voxels_in(&self, region: &Region, level: u32) -> Vec<VoxelKey> {
        let mut voxels = Vec::new();
        let selection = VoxelSelection::from(Some(*region));
        let copy = self.level_voxels(level, &selection, usize::MAX, StopSignal::NEVER);
        copy.for_some(StopSignal::NEVER, |some| voxels.extend_from_slice(some));
        voxels
    }

    /// The part of a block whose voxels of `level` are among the selected ones, each of them filled.
    pub(super) fn part_in(
        &self,
        selection: &VoxelSelection,
        level: u32,
        block: VoxelKey,
        mask: &BlockMask,
    ) -> BlockMask {
        if selection.is_everything() {
            return *mask;
        }
        let (_, up) = tier_of(level);
        let mut part = BlockMask::EMPTY;
        for cell in mask.cells(up) {
            if selection.contains(self.lattice().center_m(cell.voxel(block).ancestor(up), level)) {
                part.fill(cell, up);
            }
        }
        part
    }

    /// Calls `f` with each block of a list that can hold a selected voxel.
    ///
    /// Walks the blocks that the selection's bounds meet, or all that are stored where those are fewer; some of them
    /// once stopped.
    pub(crate) fn for_each_block(
        &self,
        list: &OccupiedVoxelList<'_>,
        selection: &VoxelSelection,
        stop: StopSignal<'_>,
        mut f: impl FnMut(VoxelKey, &BlockMask),
    ) {
        let blocks = list.blocks();
        let block_m = self.block_m(list.level());
        let radius_m = block_m * 3f64.sqrt() / 2.0;
        let may_meet = |block: &VoxelKey| {
            let center_m = block.index().map(|i| (f64::from(i) + 0.5) * block_m);
            selection.may_meet(center_m, radius_m)
        };
        let candidates = block_bounds(selection, block_m);
        if volume(&candidates) < blocks.len() as f64 {
            let candidates = stop.paced(grid(candidates), BLOCKS_PER_STOP_CHECK).filter(may_meet);
            candidates.for_each(|block| f(block, blocks.get(block)));
        } else {
            let stored =
                stop.paced(blocks.iter(), BLOCKS_PER_STOP_CHECK).filter(|(block, _)| may_meet(block));
            stored.for_each(|(block, mask)| f(block, mask));
        }
    }

    /// Most stored blocks that can hold a selected voxel of `level`: known without a look at any of them.
    pub(super) fn blocks_max(&self, level: u32, selection: &VoxelSelection) -> usize {
        let candidates = volume(&block_bounds(selection, self.block_m(level)));
        let stored: usize = self.lists(level).map(|list| list.blocks().len()).sum();
        if candidates < stored as f64 { candidates as usize } else { stored }
    }

    /// Side of the stored blocks that hold the voxels of `level`, meters.
    fn block_m(&self, level: u32) -> f64 {
        let (_, up) = tier_of(level);
        self.lattice().resolution_m(level - up) * f64::from(BLOCK_SIDE)
    }
}

/// The inclusive ranges of block indices that a selection's bounds meet, for blocks of `block_m` meters.
fn block_bounds(selection: &VoxelSelection, block_m: f64) -> [(i32, i32); 3] {
    let (min_m, max_m) = selection.bounds_m();
    let clamp = |c: f64| (c / block_m).floor().clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)) as i32;
    std::array::from_fn(|axis| (clamp(min_m[axis]), clamp(max_m[axis])))
}

/// Number of blocks in ranges of their indices.
fn volume(ranges: &[(i32, i32); 3]) -> f64 {
    ranges.iter().map(|(low, high)| (f64::from(*high) - f64::from(*low) + 1.0).max(0.0)).product()
}

fn grid([x, y, z]: [(i32, i32); 3]) -> impl Iterator<Item = VoxelKey> {
    let span = |(low, high): (i32, i32)| low..=high;
    span(z)
        .flat_map(move |z| span(y).flat_map(move |y| span(x).filter_map(move |x| VoxelKey::new([x, y, z]))))
}
