//! A point that looks for the nearest voxel, and what it found so far.

use crate::voxel::VoxelKey;

/// A point, and the nearest voxel so far. All lengths are in cells.
#[derive(Debug, Clone)]
pub(super) struct Seeker {
    /// Where it is.
    pub(super) at: [f64; 3],
    /// How far inside its cube's faces a voxel is measured to.
    inset: f64,
    /// How many levels the voxels lie above cells.
    pub(super) up: u32,
    best: Best,
}

/// A voxel that was found. One is less than another where it is taken instead.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Best {
    /// Square of its distance.
    squared: f64,
    /// Its packed key: the smallest of those equally far. No voxel has the largest number.
    key: u64,
}

impl Seeker {
    /// A point that has found nothing yet within `radius`.
    pub(super) fn new(at: [f64; 3], radius: f64, inset: f64, up: u32) -> Self {
        Self { at, inset, up, best: Best { squared: radius * radius, key: u64::MAX } }
    }

    /// Squared distances, axis by axis, to each of `N` cubes in a row, of `side` cells, the first at `first`: to
    /// whatever of it voxels are measured to.
    #[inline(always)]
    pub(super) fn squared_gaps<const N: usize>(&self, first: [i32; 3], side: i32) -> [[f64; N]; 3] {
        std::array::from_fn(|axis| {
            std::array::from_fn(|i| {
                let low = f64::from(first[axis] + i as i32 * side);
                let high = low + f64::from(side);
                let gap = larger(
                    larger(low + self.inset - self.at[axis], self.at[axis] - (high - self.inset)),
                    0.0,
                );
                gap * gap
            })
        })
    }

    /// Square of the distance that something must not exceed to be the nearest.
    #[inline(always)]
    pub(super) fn best_squared(&self) -> f64 {
        self.best.squared
    }

    /// True where something as far as that can be nearer than the best, or as near.
    #[inline(always)]
    pub(super) fn may_be_nearest(&self, squared: f64) -> bool {
        squared <= self.best.squared
    }

    /// Takes a voxel, where it is nearer than the best or as near and its key is smaller.
    #[inline(always)]
    pub(super) fn offer(&mut self, squared: f64, voxel: VoxelKey) {
        let offered = Best { squared, key: voxel.to_bits() };
        if offered < self.best {
            self.best = offered;
        }
    }

    /// The nearest voxel, its distance, and the unit vector from its nearest place to the point.
    pub(super) fn found(&self) -> Option<(VoxelKey, f64, [f64; 3])> {
        let voxel = VoxelKey::from_bits(self.best.key)?;
        let (index, distance) = (voxel.index(), self.best.squared.sqrt());
        let away = std::array::from_fn(|axis| {
            let low = f64::from(index[axis] << self.up) + self.inset;
            let high = f64::from((index[axis] + 1) << self.up) - self.inset;
            // Above it, below it, or beside it.
            let (above, below) = (larger(self.at[axis] - high, 0.0), larger(low - self.at[axis], 0.0));
            if distance > 0.0 { (above - below) / distance } else { 0.0 }
        });
        Some((voxel, distance, away))
    }
}

/// The larger of two numbers: one instruction, as long as NaN does not matter.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
