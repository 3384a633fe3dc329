//! When a ball meets a voxel: the one definition, and the exact search for the nearest voxel.
//!
//! Everything is counted in cells of the level that is asked, in f64. The cube of voxel i is \[i, i + 1\], closed; a ball of
//! center c and radius r is closed as well. They meet where the squared distance from c to the cube,
//! `(x * x + y * y) + z * z` of the gaps along the axes, is at most `r * r`.

use crate::map::MapView;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, Cell, VoxelKey};

use super::effort::Effort;
use super::surroundings::Surroundings;

/// The squared distance from `center` to the cube of `side` cells that begins at `low`, in cells.
///
/// A larger cube around it is never further, by these very roundings: subtraction and multiplication are monotone.
#[inline(always)]
pub(super) fn squared_distance(center: [f64; 3], low: [f64; 3], side: f64) -> f64 {
    let gap = |axis: usize| (low[axis] - center[axis]).max(center[axis] - (low[axis] + side)).max(0.0);
    let [x, y, z] = [gap(0), gap(1), gap(2)];
    (x * x + y * y) + z * z
}

/// A voxel, and the squared distance to it in cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearestCube {
    pub(super) squared: f64,
    pub(super) voxel: VoxelKey,
}

/// An exact search for voxels near a point.
#[derive(Debug)]
pub(super) struct CubeSearch<'a, 'e> {
    view: &'a MapView<'a>,
    surroundings: &'a Surroundings,
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
/// Blocks along an axis that are searched one by one; where there are more, their presence is asked first.
const BLOCKS_MAX: i32 = 3;

impl<'a, 'e> CubeSearch<'a, 'e> {
    /// A search around `center`, in cells of `level`.
    pub(super) fn new(
        view: &'a MapView<'a>,
        surroundings: &'a Surroundings,
        level: u32,
        center: [f64; 3],
        effort: &'a Effort<'e>,
    ) -> Self {
        Self { view, surroundings, level, center, squared_max: 0.0, found: None, is_any: false, effort }
    }

    /// True where a voxel is at most `radius` cells away.
    pub(super) fn meets(mut self, radius: f64) -> bool {
        self.is_any = true;
        self.run(radius);
        self.found.is_some()
    }

    /// The nearest voxel, where there is one at most `radius` cells away; of several the one with the smallest key.
    pub(super) fn nearest(mut self, radius: f64) -> Option<NearestCube> {
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
        let blocks_end = f64::from(1 << 20) / block + 1.0;
        // Blocks beyond the map's range hold nothing.
        let bound = |c: f64| (c / block).floor().clamp(-blocks_end, blocks_end) as i32;
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
        let mask = self.view.level_block(level, key);
        for cell in mask.cells(2) {
            if self.is_near(cell.voxel(key).ancestor(2).index(), side * 4) {
                self.search_part(level, side, key, mask.part(cell));
            }
            if self.is_done() {
                return;
            }
        }
    }

    /// Searches some voxels of a block.
    fn search_part(&mut self, level: u32, side: i32, key: VoxelKey, cells: impl Iterator<Item = Cell>) {
        for cell in cells {
            let voxel = cell.voxel(key);
            if side > 1 {
                self.search_block(level - BLOCK_LEVELS, side / BLOCK_SIDE, voxel);
            } else {
                self.consider(voxel);
            }
            if self.is_done() {
                return;
            }
        }
    }

    fn consider(&mut self, voxel: VoxelKey) {
        self.effort.spend(1);
        let squared = squared_distance(self.center, voxel.index().map(f64::from), 1.0);
        let is_better = squared < self.squared_max
            || squared == self.squared_max && self.found.is_none_or(|found| voxel < found.voxel);
        if is_better && !self.surroundings.ignores(self.view.map().lattice(), voxel, self.level) {
            (self.squared_max, self.found) = (squared, Some(NearestCube { squared, voxel }));
        }
    }
}
