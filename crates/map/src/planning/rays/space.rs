//! Space as a ray sees it: occupied, or empty up to some size.

use super::clear_box::{Blocks, clear_box};
use super::ray::{Place, Ray};
use crate::map::{CellBounds, TierView};
use crate::planning::recent_clusters::RecentClusters;
use crate::planning::unknown::FreeSpace;
use crate::voxel::{BLOCK_LEVELS, BlockInCluster, BlockMask, Cell, Cluster, VoxelKey};

/// The voxels of one level.
pub(super) struct Space<'a> {
    clusters: RecentClusters<'a>,
    bounds: CellBounds,
    /// The empty box around the place where the rays begin whose turn it is.
    clear: Option<CellBounds>,
    up: u32,
    piece_levels: u32,
}

/// A ray under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walk {
    ray: Ray,
    place: Place,
    /// Where it ends, meters.
    end_m: f64,
    /// Which of the rays it is.
    pub(super) number: usize,
}

/// What one step of a walk came to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    /// It goes on.
    Further,
    /// It met this voxel, so many meters from its begin.
    Hit(f64, VoxelKey),
    /// It ended.
    Missed,
}

impl Walk {
    /// How far it has come, meters.
    pub(super) fn at_m(&self) -> f64 {
        self.place.at_m
    }

    /// Where it ends, or leaves the space, meters.
    pub(super) fn end_m(&self) -> f64 {
        self.end_m
    }
}

impl<'a> Space<'a> {
    /// Space without a voxel beyond `bounds`; `nothing` is a cluster without a block.
    pub(super) fn new(view: TierView<'a>, bounds: CellBounds, nothing: &'a Cluster) -> Self {
        let (up, piece_levels) = (view.up(), view.piece_levels());
        Self { clusters: RecentClusters::new(view, nothing), bounds, clear: None, up, piece_levels }
    }

    /// Looks at what is around `origin` (cells), where the next so many rays begin.
    pub(super) fn look_around(&mut self, origin: [f64; 3], rays: usize) {
        let cell = origin.map(|c| c.floor() as i32);
        // One cluster must hold all of a block.
        self.clear = if self.piece_levels < BLOCK_LEVELS {
            None
        } else {
            clear_box(&mut self.clusters, cell, &self.bounds, (rays, self.up))
        };
    }

    /// The walk of a ray of length `range_m`; none where it misses all.
    #[inline(always)]
    pub(super) fn walk(&self, number: usize, ray: Ray, range_m: f64) -> Option<Walk> {
        let (mut place, end_m) = ray.clipped(&self.bounds, range_m)?;
        if let Some(clear) = &self.clear {
            place = ray.out_of(&place, clear).unwrap_or(place);
        }
        (place.at_m < end_m).then_some(Walk { ray, place, end_m, number })
    }

    /// Leaps over the empty space around the place of a walk, where it is empty.
    #[inline(always)]
    pub(super) fn step(&mut self, walk: &mut Walk) -> Step {
        let cell = walk.ray.cell(&walk.place);
        let Some(levels) = self.empty_levels(cell) else {
            return Step::Hit(walk.place.at_m, VoxelKey::pack(cell.map(|i| i >> self.up)));
        };
        walk.place = walk.ray.beyond(&walk.place, levels);
        if walk.place.at_m < walk.end_m { Step::Further } else { Step::Missed }
    }

    /// Goes on to the next voxel of `level` where that at the place of a walk is free.
    pub(super) fn step_in_sight(
        &mut self,
        walk: &mut Walk,
        level: u32,
        free_space: &mut FreeSpace<'_>,
    ) -> Step {
        let cell = walk.ray.cell(&walk.place);
        let voxel = VoxelKey::pack(cell.map(|i| i >> self.up));
        if self.empty_levels(cell).is_none() || !free_space.is_seen_through(voxel, level) {
            return Step::Hit(walk.place.at_m, voxel);
        }
        walk.place = walk.ray.beyond(&walk.place, self.up);
        if walk.place.at_m < walk.end_m { Step::Further } else { Step::Missed }
    }

    /// How large the empty aligned cube around `cell` is: the levels from a cell up to it. None where the voxel that
    /// holds the cell is occupied.
    #[inline(always)]
    fn empty_levels(&mut self, cell: [i32; 3]) -> Option<u32> {
        let (place, in_block) = (BlockInCluster::of_voxel(cell), Cell::of(cell).1);
        let levels = self.clusters.around(cell).empty_levels(place, in_block, self.up)?;
        Some(levels.min(self.piece_levels))
    }
}

impl Blocks for RecentClusters<'_> {
    #[inline(always)]
    fn around(&mut self, cell: [i32; 3]) -> &BlockMask {
        RecentClusters::around(self, cell).get(BlockInCluster::of_voxel(cell))
    }
}
