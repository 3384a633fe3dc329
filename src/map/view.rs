//! How a map is read: all the locks it takes, at once, and so one revision.

use super::lookup::{self, LevelView, Lookup};
use super::occupied_voxel_list::tier_of;
use super::shard::Shard;
use super::sharding::{SHARDS, ShardsTouched};
use super::{ContentVersion, MomentsView, MultiResolutionMap, OccupiedVoxelList, Region};
use crate::geometry::Point;
use crate::sync::RwLockReadGuard;
use crate::util::StopSignal;
use crate::voxel::{
    BLOCK_LEVELS, BLOCK_SIDE, BLOCKS_PER_LOOK, BlockMask, Cell, INDEX_MAX, INDEX_MIN, LatticeFromPoints,
    VoxelKey, VoxelSet,
};

/// Read locks on some or all shards of a map. While it lives, what it covers does not change.
#[derive(Debug)]
pub struct MapView<'a> {
    map: &'a MultiResolutionMap,
    shards: [Option<RwLockReadGuard<'a, Shard>>; SHARDS],
    version: ContentVersion,
}

/// A read that takes long, see [`MultiResolutionMap::long_read`].
#[derive(Debug)]
pub struct LongRead<'a> {
    pub(super) map: &'a MultiResolutionMap,
    pub(super) _changes_wait: RwLockReadGuard<'a, ()>,
}

impl LongRead<'_> {
    /// Locks the whole map for reading.
    pub fn view(&self) -> MapView<'_> {
        self.map.view()
    }

    /// Locks the moments of the map's points for reading; before a view, where both are needed.
    pub fn moments(&self) -> MomentsView<'_> {
        self.map.moments()
    }
}

impl<'a> MapView<'a> {
    /// Takes the locks in ascending order, as committers do, so that nobody waits in a circle. The revision is
    /// read once they are held: a change that is published later touches none of these shards.
    pub(super) fn lock(map: &'a MultiResolutionMap, touched: ShardsTouched) -> Self {
        let shards = std::array::from_fn(|i| touched.contains(i).then(|| map.shards[i].read()));
        Self { map, shards, version: map.content_version() }
    }

    /// A view where no lock has to be waited for; none elsewhere.
    pub(super) fn try_lock(map: &'a MultiResolutionMap, touched: ShardsTouched) -> Option<Self> {
        let mut shards = [const { None }; SHARDS];
        for i in (0..SHARDS).filter(|&i| touched.contains(i)) {
            shards[i] = Some(map.shards[i].try_read()?);
        }
        Some(Self { map, shards, version: map.content_version() })
    }

    /// The revision that everything read through this view belongs to.
    pub fn revision(&self) -> u64 {
        self.version.revision
    }

    /// That revision, with the hash of what the whole map holds then.
    pub fn version(&self) -> ContentVersion {
        self.version
    }

    /// Says of each point whether its voxel of `level` is occupied: point i is bit i % 64 of `occupied[i / 64]`.
    /// Points in no voxel are not occupied; true when there were none of them.
    ///
    /// The view must cover the points.
    pub fn query(
        &self,
        points: &[Point],
        lattice_from_points: &LatticeFromPoints,
        level: u32,
        lookup: Lookup,
        occupied: &mut [u64],
    ) -> bool {
        lookup::occupied(points, lattice_from_points, &self.level_view(level), lookup, occupied)
    }

    /// Number of points whose voxel of `level` is occupied. The view must cover the points.
    pub fn count(
        &self,
        points: &[Point],
        lattice_from_points: &LatticeFromPoints,
        level: u32,
        lookup: Lookup,
    ) -> usize {
        lookup::count(points, lattice_from_points, &self.level_view(level), lookup)
    }

    /// The shards that the view covers.
    pub(super) fn shards(&self) -> impl Iterator<Item = &Shard> {
        self.shards.iter().flatten().map(|shard| &**shard)
    }

    /// The shards, of those that the view covers, that the voxel at `index` of `level`, however coarse, lies in.
    pub(super) fn shards_of(&self, index: [i32; 3], level: u32) -> impl Iterator<Item = &Shard> {
        let one = self.map.sharding.shard_of_node(index, level);
        let range = one.map_or(0..SHARDS, |one| one..one + 1);
        self.shards[range].iter().flatten().map(|shard| &**shard)
    }

    /// The map that is read.
    pub fn map(&self) -> &'a MultiResolutionMap {
        self.map
    }

    /// What the look-up kernels read of `level`.
    pub(crate) fn level_view(&self, level: u32) -> LevelView<'_> {
        let list = |shard: usize| self.shards[shard].as_deref().map(|shard| shard.level(level));
        let (_, up) = tier_of(level);
        LevelView::new(level, up, self.map.sharding.shift_at(level), self.map.settings.filter.hashes, list)
    }

    /// The lists of `level`, one a shard that the view covers.
    pub fn lists(&self, level: u32) -> impl Iterator<Item = OccupiedVoxelList<'_>> {
        self.shards.iter().flatten().map(move |shard| shard.level(level))
    }

    /// True when `voxel` of `level` is occupied, exactly. False where the view does not cover it.
    pub fn contains(&self, voxel: VoxelKey, level: u32) -> bool {
        let shard = self.map.sharding.shard_of(voxel.index(), level);
        self.shards[shard].as_deref().is_some_and(|shard| shard.level(level).contains(voxel))
    }

    /// True when the filter lets `voxel` of `level` through.
    pub fn may_contain(&self, voxel: VoxelKey, level: u32) -> bool {
        let shard = self.map.sharding.shard_of(voxel.index(), level);
        self.shards[shard].as_deref().is_some_and(|shard| shard.level(level).may_contain(voxel))
    }

    /// How many of `voxels` are not in the map. The view must cover them.
    pub fn absent(&self, voxels: &VoxelSet) -> usize {
        let absent = |&(block, mask): &(VoxelKey, BlockMask)| {
            let finest = block.index().map(|i| i << BLOCK_LEVELS);
            let shard = self.shards[self.map.sharding.shard_of(finest, 0)].as_deref();
            let present = shard.map_or(&BlockMask::EMPTY, |shard| shard.level(0).blocks().get(block));
            mask.difference(present).count(0)
        };
        voxels.blocks().iter().map(absent).sum()
    }

    /// All finest voxels that the view covers.
    pub fn voxels(&self) -> VoxelSet {
        self.voxels_until(StopSignal::NEVER)
    }

    /// All finest voxels that the view covers; once stopped, some of them.
    pub(super) fn voxels_until(&self, stop: StopSignal<'_>) -> VoxelSet {
        let mut all = Vec::with_capacity(self.lists(0).map(|list| list.blocks().len()).sum());
        all.extend(
            stop.paced(self.shards.iter().flatten().flat_map(|shard| shard.blocks()), BLOCKS_PER_LOOK),
        );
        VoxelSet::of_blocks_until(all, stop)
    }

    /// The finest voxels at and below the voxels `keys` of `level`, of those that are there.
    pub fn descendants_of(&self, keys: impl IntoIterator<Item = VoxelKey>, level: u32) -> VoxelSet {
        let (tier, up) = tier_of(level);
        let mut by_shard: [Vec<(VoxelKey, BlockMask)>; SHARDS] = Default::default();
        for key in keys {
            let (block, cell) = Cell::of(key.index().map(|i| i << up));
            let blocks = &mut by_shard[self.map.sharding.shard_of(key.index(), level)];
            // Keys come row by row: the last block is met again more often than not.
            match blocks.last_mut() {
                Some((last, mask)) if *last == block => mask.fill(cell, up),
                _ => {
                    let mut mask = BlockMask::EMPTY;
                    mask.fill(cell, up);
                    blocks.push((block, mask));
                }
            }
        }
        let mut found = Vec::new();
        for (shard, blocks) in self.shards.iter().zip(by_shard) {
            if let Some(shard) = shard {
                let wanted: VoxelSet = blocks.into_iter().collect();
                found.extend_from_slice(shard.descendants(tier, wanted.blocks()).blocks());
            }
        }
        found.into_iter().collect()
    }

    /// The finest voxels at and below the voxels of `level` whose centers lie in `region`.
    ///
    /// Takes some 72 bytes a block of finest voxels, and no more for a voxel.
    pub fn finest_in(&self, region: &Region, level: u32) -> VoxelSet {
        self.finest_in_until(region, level, StopSignal::NEVER)
    }

    /// [`MapView::finest_in`] under a stop signal; once stopped, some of the voxels.
    pub fn finest_in_until(&self, region: &Region, level: u32, stop: StopSignal<'_>) -> VoxelSet {
        let (tier, _) = tier_of(level);
        let mut found = Vec::new();
        for shard in self.shards() {
            let mut blocks = Vec::new();
            self.for_each_block(&shard.level(level), region, stop, |block, mask| {
                let wanted = self.part_in(region, level, block, mask);
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
        let copy = self.level_voxels(level, Some(region), usize::MAX, StopSignal::NEVER);
        copy.for_some(StopSignal::NEVER, |some| voxels.extend_from_slice(some));
        voxels
    }

    /// The part of a block whose voxels of `level` have their centers in `region`, each of them filled.
    pub(super) fn part_in(
        &self,
        region: &Region,
        level: u32,
        block: VoxelKey,
        mask: &BlockMask,
    ) -> BlockMask {
        let (_, up) = tier_of(level);
        let mut part = BlockMask::EMPTY;
        for cell in mask.cells(up) {
            if region.contains(self.map.lattice.center_m(cell.voxel(block).ancestor(up), level)) {
                part.fill(cell, up);
            }
        }
        part
    }

    /// Calls `f` with each block of a list that can hold a voxel of `region`.
    ///
    /// Walks the blocks that the region's bounds meet, or all that are stored where those are fewer; some of them once
    /// stopped.
    pub(super) fn for_each_block(
        &self,
        list: &OccupiedVoxelList<'_>,
        region: &Region,
        stop: StopSignal<'_>,
        mut f: impl FnMut(VoxelKey, &BlockMask),
    ) {
        let (level, blocks) = (list.level(), list.blocks());
        let (_, up) = tier_of(level);
        let candidates = block_bounds(region, self.map.lattice.resolution_m(level - up));
        let volume: f64 = candidates
            .iter()
            .map(|(low, high)| (f64::from(*high) - f64::from(*low) + 1.0).max(0.0))
            .product();
        if volume < blocks.len() as f64 {
            stop.paced(grid(candidates), BLOCKS_PER_LOOK).for_each(|block| f(block, blocks.get(block)));
        } else {
            stop.paced(blocks.iter(), BLOCKS_PER_LOOK).for_each(|(block, mask)| f(block, mask));
        }
    }
}

/// The inclusive ranges of block indices that a region's bounds meet, for blocks of voxels of `resolution_m`.
fn block_bounds(region: &Region, resolution_m: f64) -> [(i32, i32); 3] {
    let (min_m, max_m) = region.bounds_m();
    let block_m = resolution_m * f64::from(BLOCK_SIDE);
    let clamp = |c: f64| (c / block_m).floor().clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)) as i32;
    std::array::from_fn(|axis| (clamp(min_m[axis]), clamp(max_m[axis])))
}

fn grid([x, y, z]: [(i32, i32); 3]) -> impl Iterator<Item = VoxelKey> {
    let span = |(low, high): (i32, i32)| low..=high;
    span(z)
        .flat_map(move |z| span(y).flat_map(move |y| span(x).filter_map(move |x| VoxelKey::new([x, y, z]))))
}
