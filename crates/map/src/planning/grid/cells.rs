//! Cells of a grid: squares whose sides are whole voxels.

use crate::map::Region;

/// How far, as a share of a cell, a number may lie from whole cells or voxels and still count as that.
pub(super) const WHOLE_WITHIN: f64 = 1e-6;

/// A rectangle of whole cells, in cells from the map's origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    pub(super) first: [i64; 2],
    pub(super) end: [i64; 2],
}

impl Cells {
    pub(super) const NONE: Self = Self { first: [0; 2], end: [0; 2] };

    /// Those that a rectangle in meters meets, in more than a border; the one above where it has no extent.
    pub(super) fn of_rectangle(min_m: [f64; 2], max_m: [f64; 2], cell_m: f64) -> Self {
        let first = min_m.map(|c| whole(c / cell_m).unwrap_or_else(|| (c / cell_m).floor()) as i64);
        let end = max_m.map(|c| whole(c / cell_m).unwrap_or_else(|| (c / cell_m).ceil()) as i64);
        Self { first, end: std::array::from_fn(|axis| end[axis].max(first[axis].saturating_add(1))) }
    }

    pub(super) fn size(&self, axis: usize) -> i64 {
        self.end[axis].saturating_sub(self.first[axis])
    }

    /// The number of a cell.
    #[inline(always)]
    pub(super) fn number(&self, cell: [i64; 2]) -> Option<usize> {
        let [x, y] = std::array::from_fn(|axis| cell[axis] - self.first[axis]);
        let is_inside = (0..self.size(0)).contains(&x) && (0..self.size(1)).contains(&y);
        is_inside.then(|| (y * self.size(0) + x) as usize)
    }

    pub(super) fn region(&self, cell_m: f64, band_m: [f64; 2]) -> Region {
        let [[x, y], [end_x, end_y]] = [self.first, self.end].map(|corner| corner.map(|c| c as f64 * cell_m));
        Region::Box { min_m: [x, y, band_m[0]], max_m: [end_x, end_y, band_m[1]] }
    }
}

/// The whole number that `number` nearly is.
pub(super) fn whole(number: f64) -> Option<f64> {
    let whole = number.round();
    ((number - whole).abs() <= WHOLE_WITHIN).then_some(whole)
}
