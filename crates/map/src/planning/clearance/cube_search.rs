//! When a ball meets a voxel: the one definition, and the exact search for the nearest voxel.
//!
//! Everything is counted in cells of the level that is asked, in f64. The cube of voxel i is \[i, i + 1\], closed; a
//! ball of center c and radius r is closed as well. They meet where the squared distance from c to the cube, `(x * x +
//! y * y) + z * z` of the gaps along the axes, is at most `r * r`.

use crate::map::MapView;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell, VoxelKey};

use super::level::FieldLevel;
use crate::planning::effort::Effort;
use crate::planning::unknown::{ALL, FreeSpace, Surroundings};

/// The squared distance from `center` to the cube of `side` cells that begins at `low`, in cells.
///
/// A larger cube around it is never further, by these very roundings: subtraction and multiplication are monotone.
#[inline(always)]
pub(in crate::planning) fn squared_distance(center: [f64; 3], low: [f64; 3], side: f64) -> f64 {
    let gap = |axis: usize| (low[axis] - center[axis]).max(center[axis] - (low[axis] + side)).max(0.0);
    let [x, y, z] = [gap(0), gap(1), gap(2)];
    (x * x + y * y) + z * z
}

/// A voxel, and the squared distance to it in cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::planning) struct NearestCube {
    pub(in crate::planning) squared: f64,
    pub(in crate::planning) voxel: VoxelKey,
}

/// An exact search for voxels near a point.
#[derive(Debug)]
pub(in crate::planning) struct CubeSearch<'a, 'e> {
    view: &'a MapView<'a>,
    surroundings: &'a Surroundings,
    /// Where unknown voxels count: what was seen through.
    free_space: Option<FreeSpace<'a>>,
    /// The field of the level, which knows what counts where it is made.
    field: &'a FieldLevel,
    level: u32,
    center: [f64; 3],
    /// Squared distance beyond which nothing counts.
    squared_max: f64,
    found: Option<NearestCube>,
    /// True where any voxel will do.
    is_any: bool,
    /// Counts what is looked at. Once stopped the search ends, and what it found means nothing.
    effort: &'a Effort<'e>,
}

/// Cells beyond a ball that are looked at, whatever the rounding.
pub(super) const SLACK: f64 = 1e-6;
/// The first radius of searches in which unknown voxels count, cells.
const FIRST_CELLS: f64 = 4.0;
/// What a voxel costs of which it is asked whether it was seen through, in units of effort.
const SEEN_EFFORT: u32 = 4;
/// Blocks along an axis that are searched one by one; where there are more, their presence is asked first.
const BLOCKS_MAX: i32 = 3;

impl<'a, 'e> CubeSearch<'a, 'e> {
    /// A search around `center`, in cells of `level`.
    pub(in crate::planning) fn new(
        view: &'a MapView<'a>,
        surroundings: &'a Surroundings,
        (level, field): (u32, &'a FieldLevel),
        center: [f64; 3],
        effort: &'a Effort<'e>,
    ) -> Self {
        let free_space = surroundings.unknown_counts().then(|| FreeSpace::of(view));
        let (squared_max, found, is_any) = (0.0, None, false);
        Self { view, surroundings, free_space, field, level, center, squared_max, found, is_any, effort }
    }

    /// True where a voxel is at most `radius` cells away.
    pub(in crate::planning) fn meets(mut self, radius: f64) -> bool {
        self.is_any = true;
        self.run(radius);
        self.found.is_some()
    }

    /// The nearest voxel, where there is one at most `radius` cells away; of several the one with the smallest key.
    pub(in crate::planning) fn nearest(mut self, radius: f64) -> Option<NearestCube> {
        if self.free_space.is_some() {
            // Most of space is unknown, so that something is near: all of a ball is not looked at for it.
            let mut near = FIRST_CELLS;
            while near < radius && self.found.is_none() && !self.is_done() {
                self.run(near);
                near *= 2.0;
            }
            if self.found.is_some() {
                return self.found;
            }
        }
        self.run(radius);
        self.found
    }

    fn run(&mut self, radius: f64) {
        self.squared_max = radius * radius;
        let (mut level, mut side) = (self.level, 1i32);
        let end = self.view.map().block_levels_end();
        while 2.0 * radius > f64::from(BLOCKS_MAX * BLOCK_SIDE * side) && level + BLOCK_LEVELS <= end {
            level += BLOCK_LEVELS;
            side *= BLOCK_SIDE;
        }
        let block = f64::from(BLOCK_SIDE * side);
        // Blocks beyond the map's range hold nothing, unknown or not; a level's range is a whole number of them.
        let range = f64::from(1u32 << 20 >> self.level) / block;
        let bound = |c: f64| (c / block).floor().clamp(-range, range - 1.0) as i32;
        let [xs, ys, zs] = self.center.map(|c| bound(c - radius - SLACK)..=bound(c + radius + SLACK));
        for (z, y) in zs.flat_map(|z| ys.clone().map(move |y| (z, y))) {
            for x in xs.clone() {
                if self.is_done() {
                    return;
                }
                if let Some(block) = VoxelKey::new([x, y, z]) {
                    self.search_block(level, side, block);
                }
            }
        }
    }

    fn is_done(&self) -> bool {
        self.effort.is_stopped() || self.is_any && self.found.is_some()
    }

    /// True where the cube of `side` cells at `index` of them may hold a voxel that counts.
    fn is_near(&self, index: [i32; 3], side: i32) -> bool {
        let low = index.map(|i| f64::from(i) * f64::from(side));
        squared_distance(self.center, low, f64::from(side)) <= self.squared_max
    }

    /// Searches the block at `key`, whose voxels of `level` are `side` cells wide.
    fn search_block(&mut self, level: u32, side: i32, key: VoxelKey) {
        self.effort.spend(1);
        if !self.is_near(key.index(), side * BLOCK_SIDE) {
            return;
        }
        let (candidates, occupied) = self.candidates(level, key);
        for cell in candidates.cells(2) {
            if self.is_near(cell.voxel(key).ancestor(2).index(), side * 4) {
                self.search_part((level, side), key, candidates.part(cell), &occupied);
            }
            if self.is_done() {
                return;
            }
        }
    }

    /// The voxels of a block that may count, and those of them that count without a look at what was seen through.
    fn candidates(&self, level: u32, key: VoxelKey) -> (BlockMask, BlockMask) {
        if self.free_space.is_none() {
            let occupied = self.view.level_block(level, key);
            return (occupied, occupied);
        }
        match self.field.obstacles(key).filter(|_| level == self.level) {
            Some(obstacles) => (obstacles, obstacles),
            None => (ALL, self.view.level_block(level, key)),
        }
    }

    /// Searches some voxels of a block, of which those of a mask are occupied.
    fn search_part(
        &mut self,
        (level, side): (u32, i32),
        key: VoxelKey,
        cells: impl Iterator<Item = Cell>,
        occupied: &BlockMask,
    ) {
        for cell in cells {
            let voxel = cell.voxel(key);
            if side > 1 {
                self.search_block(level - BLOCK_LEVELS, side / BLOCK_SIDE, voxel);
            } else {
                self.consider(voxel, occupied.contains(cell, 0));
            }
            if self.is_done() {
                return;
            }
        }
    }

    fn consider(&mut self, voxel: VoxelKey, is_occupied: bool) {
        self.effort.spend(1);
        let squared = squared_distance(self.center, voxel.index().map(f64::from), 1.0);
        let is_better = squared < self.squared_max
            || squared == self.squared_max && self.found.is_none_or(|found| voxel < found.voxel);
        let counts = is_better && (is_occupied || self.is_unknown(voxel));
        if counts && !self.surroundings.ignores(self.view.map().lattice(), voxel, self.level) {
            (self.squared_max, self.found) = (squared, Some(NearestCube { squared, voxel }));
        }
    }

    /// True of a voxel that is not occupied where unknown ones count and it is one.
    fn is_unknown(&mut self, voxel: VoxelKey) -> bool {
        self.free_space.as_mut().is_some_and(|free_space| {
            self.effort.spend(SEEN_EFFORT);
            !free_space.is_seen_through(voxel, self.level)
        })
    }
}
