//! How a map is read: all the locks it takes, at once, and so one revision.

use std::sync::Arc;

use super::content_hash::ContentVersion;
use super::keep_out::KeepOuts;
use super::lookup::{self, LevelView, Lookup};
use super::moments::MomentsView;
use super::multi_resolution_map::MultiResolutionMap;
use super::shards::{OccupiedVoxelList, SHARDS, Shard, ShardsTouched, TierView, tier_of};
use crate::geometry::{Point, Pose};
use crate::sync::RwLockReadGuard;
use crate::util::StopSignal;
use crate::visibility::ViewpointSet;
use crate::voxel::{
    BLOCK_LEVELS, BLOCKS_PER_STOP_CHECK, BlockMask, Cell, Lattice, LatticeFromPoints, VoxelKey, VoxelSet,
};

/// Read locks on some or all shards of a map. While it lives, what it covers does not change.
#[derive(Debug)]
pub struct MapView<'a> {
    map: &'a MultiResolutionMap,
    shards: [Option<RwLockReadGuard<'a, Shard>>; SHARDS],
    version: ContentVersion,
    /// Where they were asked for.
    keep_outs: Option<Arc<KeepOuts>>,
    viewpoints: Option<Arc<ViewpointSet>>,
}

/// A read that takes long, see [`MultiResolutionMap::long_read`].
#[derive(Debug)]
pub struct LongRead<'a> {
    map: &'a MultiResolutionMap,
    _changes_wait: RwLockReadGuard<'a, ()>,
}

impl<'a> LongRead<'a> {
    /// The map that is read.
    pub(super) fn map(&self) -> &'a MultiResolutionMap {
        self.map
    }

    /// Locks the whole map for reading.
    pub fn view(&self) -> MapView<'_> {
        self.map.view()
    }

    /// Locks the moments of the map's points for reading; before a view, where both are needed. None of a map that
    /// keeps no moments.
    pub fn moments(&self) -> Option<MomentsView<'_>> {
        self.map.moments()
    }
}

impl<'a> MapView<'a> {
    /// A view of the whole map, at one revision: [`MultiResolutionMap::view`].
    pub(super) fn of(map: &'a MultiResolutionMap) -> Self {
        Self::lock(map, ShardsTouched::all())
    }

    /// Takes the locks in ascending order, as committers do, so that nobody waits in a circle. The revision is
    /// read once they are held: a change that is published later touches none of these shards.
    fn lock(map: &'a MultiResolutionMap, touched: ShardsTouched) -> Self {
        let shards = std::array::from_fn(|i| touched.contains(i).then(|| map.shards[i].read()));
        Self { map, shards, version: map.content_version(), keep_outs: None, viewpoints: None }
    }

    /// A view where no lock has to be waited for; none elsewhere.
    fn try_lock(map: &'a MultiResolutionMap, touched: ShardsTouched) -> Option<Self> {
        let mut shards = [const { None }; SHARDS];
        for i in (0..SHARDS).filter(|&i| touched.contains(i)) {
            shards[i] = Some(map.shards[i].try_read()?);
        }
        Some(Self { map, shards, version: map.content_version(), keep_outs: None, viewpoints: None })
    }

    /// This view with the keep-outs of the map, all at one revision, which may be a later one: what the view covers has
    /// not changed since.
    #[must_use]
    pub fn with_keep_outs(self) -> Self {
        // Nobody publishes a change of what is locked: of the shards before, of the keep-outs now.
        let keep_outs = self.map.keep_outs.read();
        let (keep_outs, version) = (Some(Arc::clone(&keep_outs)), self.map.content_version());
        Self { keep_outs, version, ..self }
    }

    /// [`MapView::with_keep_outs`] where no lock has to be waited for; none elsewhere.
    pub fn try_with_keep_outs(self) -> Option<Self> {
        let keep_outs = self.map.keep_outs.try_read()?;
        let (keep_outs, version) = (Some(Arc::clone(&keep_outs)), self.map.content_version());
        Some(Self { keep_outs, version, ..self })
    }

    /// The keep-outs, where the view was asked for them.
    pub fn keep_outs(&self) -> Option<&Arc<KeepOuts>> {
        self.keep_outs.as_ref()
    }

    /// This view with where scans saw through, all at one revision, which may be a later one: what the view covers has
    /// not changed since.
    #[must_use]
    pub fn with_viewpoints(self) -> Self {
        // Keep-outs may have changed since they were asked for: both are taken anew, at once.
        let keep_outs = self.keep_outs.is_some().then(|| self.map.keep_outs.read());
        let viewpoints = self.map.viewpoints.read();
        let version = self.map.content_version();
        let keep_outs = keep_outs.as_deref().map(Arc::clone);
        let viewpoints = Some(Arc::clone(&viewpoints));
        Self { keep_outs, viewpoints, version, ..self }
    }

    /// [`MapView::with_viewpoints`] where no lock has to be waited for; none elsewhere.
    pub fn try_with_viewpoints(self) -> Option<Self> {
        let keep_outs = match &self.keep_outs {
            Some(_) => Some(self.map.keep_outs.try_read()?),
            None => None,
        };
        let viewpoints = self.map.viewpoints.try_read()?;
        let version = self.map.content_version();
        let keep_outs = keep_outs.as_deref().map(Arc::clone);
        let viewpoints = Some(Arc::clone(&viewpoints));
        Some(Self { keep_outs, viewpoints, version, ..self })
    }

    /// Where scans saw through, where the view was asked for that.
    pub fn viewpoints(&self) -> Option<&Arc<ViewpointSet>> {
        self.viewpoints.as_ref()
    }

    /// Gives the locks back: from now on the view covers nothing.
    pub(super) fn let_go(&mut self) {
        self.shards = [const { None }; SHARDS];
    }

    /// The lattices of the map's levels.
    pub fn lattice(&self) -> &Lattice {
        &self.map.lattice
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
    pub fn level_view(&self, level: u32) -> LevelView<'_> {
        let list = |shard: usize| self.shards[shard].as_deref().map(|shard| shard.level(level));
        let (_, up) = tier_of(level);
        let hashes = self.map.settings.filter.map(|filter| filter.hashes);
        LevelView::new(level, up, self.map.sharding.shift_at(level), hashes, list)
    }

    /// The clusters that serve `level`; where the view does not cover a shard they are absent.
    pub(crate) fn tier_view(&self, level: u32) -> TierView<'_> {
        let list = |shard: usize| self.shards[shard].as_deref().map(|shard| shard.level(level));
        let (_, up) = tier_of(level);
        let (region_shift, cell_m) =
            (self.map.sharding.shift_at(level - up), self.map.lattice.resolution_m(level - up));
        TierView::new(level, region_shift, cell_m, list)
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

    /// True when the filter lets `voxel` of `level` through, or where there is no filter, when it is occupied.
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
            stop.paced(self.shards.iter().flatten().flat_map(|shard| shard.blocks()), BLOCKS_PER_STOP_CHECK),
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
}

impl MultiResolutionMap {
    /// Locks the whole map for reading, at one revision. For a few milliseconds at most: whoever reads for longer
    /// begins with [`MultiResolutionMap::long_read`].
    pub fn view(&self) -> MapView<'_> {
        MapView::of(self)
    }

    /// Keeps changes from beginning to take their locks, for a read that takes longer than a few milliseconds. Changes
    /// wait for it, and for no other: a long read that comes while one waits goes behind it. Readers of
    /// [`MultiResolutionMap::view`] and [`MultiResolutionMap::view_of`] wait for neither.
    pub fn long_read(&self) -> LongRead<'_> {
        LongRead { _changes_wait: self.long_reads.read(), map: self }
    }

    /// [`MultiResolutionMap::long_read`] where no change has to be waited for; none elsewhere. For threads that may not
    /// wait.
    pub fn try_long_read(&self) -> Option<LongRead<'_>> {
        Some(LongRead { _changes_wait: self.long_reads.try_read()?, map: self })
    }

    /// [`MultiResolutionMap::view`] where no lock has to be waited for; none elsewhere. For threads that may not wait.
    pub fn try_view(&self) -> Option<MapView<'_>> {
        MapView::try_lock(self, ShardsTouched::all())
    }

    /// Locks what `points`, placed at `map_from_points`, can fall in.
    pub fn view_of(&self, points: &[Point], map_from_points: &Pose) -> MapView<'_> {
        MapView::lock(self, self.sharding.touched_by(points, map_from_points, &self.lattice))
    }

    /// [`MultiResolutionMap::view_of`] where no lock has to be waited for; none elsewhere. For threads that may not
    /// wait.
    pub fn try_view_of(&self, points: &[Point], map_from_points: &Pose) -> Option<MapView<'_>> {
        MapView::try_lock(self, self.sharding.touched_by(points, map_from_points, &self.lattice))
    }
}
