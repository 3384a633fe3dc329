//! The answer: the map from above.

/// The map from above, row by row from the smallest y, each from the smallest x: cell (x, y) has the number
/// y * `size[0]` + x.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Side of a cell, meters.
    pub cell_m: f64,
    /// Corner of the grid: smallest x and y, meters.
    pub origin_m: [f64; 2],
    /// Number of cells along x and y; none where an area was asked for that is as large as what is there, and nothing
    /// is.
    pub size: [usize; 2],
    /// Whether cell i has a voxel or a keep-out: bit i % 64 of `occupied[i / 64]`.
    pub occupied: Vec<u64>,
    /// Height of the top of the highest voxel of each cell that reaches into the band, meters, which may lie above it by
    /// less than a voxel; NaN for a cell without one.
    pub tops_m: Vec<f32>,
    /// Whether cell i is free, as `occupied`, where that was asked for: a cell is unknown that is neither. Where it was
    /// not, the grid does not tell what was seen.
    pub free: Option<Vec<u64>>,
}

impl Grid {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.tops_m.len()
    }

    /// True when cell `number` has a voxel or a keep-out.
    pub fn is_occupied(&self, number: usize) -> bool {
        self.occupied[number / 64] >> (number % 64) & 1 == 1
    }

    /// True when cell `number` is unknown, where the grid tells that.
    pub fn is_unknown(&self, number: usize) -> bool {
        let is_free = |free: &Vec<u64>| free[number / 64] >> (number % 64) & 1 == 1;
        !self.is_occupied(number) && self.free.as_ref().is_some_and(|free| !is_free(free))
    }
}
