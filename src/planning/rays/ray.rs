//! One ray through a lattice of cells: which cells it meets, and where (Amanatides and Woo, *A Fast Voxel Traversal
//! Algorithm for Ray Tracing*, 1987).

use crate::map::CellBounds;

/// A ray in cells, each axis along which it descends turned over, so that it ascends along all of them.
///
/// It passes the border below cell i of an axis at `(i - origin) * m_a_cell` meters, computed in just this way wherever it
/// is needed. So a leap over many cells ends in the cell that single steps would have led to, bit for bit.
///
/// Turned over, cell i is cell -1 - i, and a border belongs to the cell that the ray moves into.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Where it begins, cells.
    origin: [f64; 3],
    /// Meters along the ray from border to border of an axis; infinite along an axis on which it does not move.
    m_a_cell: [f64; 3],
    /// Cells passed along each axis, a meter along the ray.
    cells_a_m: [f64; 3],
    /// -1 for an axis that is turned over, 0 for others: exclusive or with it turns an index.
    turned: [i32; 3],
}

/// A place on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Distance from the ray's begin, meters.
    pub(super) at_m: f64,
    /// The cell, turned as the ray is.
    pub(super) cell: [i32; 3],
}

/// How near to a border, in cells, the cell of a place is decided by where the ray passes the border: far more than rounding
/// moves a place, which is at most 2^-29 of a cell.
const NEAR_BORDER: f64 = 1e-6;
/// Adding it rounds a number below 2^31 to a whole one, which is then the sum's low 32 bits.
const ROUNDS: f64 = 1.5 * (1u64 << 52) as f64;

impl Ray {
    /// The ray from `origin` (cells) along the unit vector `direction`, through cells of side `cell_m`.
    pub(super) fn new(origin: [f64; 3], direction: [f64; 3], cell_m: f64) -> Self {
        let turned = direction.map(|d| -i32::from(d < 0.0));
        Self {
            origin: std::array::from_fn(|axis| if turned[axis] == 0 { origin[axis] } else { -origin[axis] }),
            m_a_cell: direction.map(|d| cell_m / d.abs()),
            cells_a_m: direction.map(|d| d.abs() / cell_m),
            turned,
        }
    }

    /// An index turned, or turned back.
    #[inline(always)]
    pub(super) fn turn(&self, cell: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|axis| cell[axis] ^ self.turned[axis])
    }

    /// Where the ray meets a box, and the distance at which it leaves it or ends, meters: none where it does not meet it
    /// before `range_m`.
    pub(super) fn clipped(&self, bounds: &CellBounds, range_m: f64) -> Option<(Place, f64)> {
        let (mut at_m, mut end_m) = (0.0, range_m);
        for axis in 0..3 {
            let (first, end) = match self.turned[axis] {
                0 => (bounds.first[axis], bounds.end[axis]),
                _ => (-bounds.end[axis], -bounds.first[axis]),
            };
            // NaN, on a border along which the ray runs, bounds nothing.
            at_m = f64::max(at_m, self.border_m(axis, first));
            end_m = f64::min(end_m, self.border_m(axis, end));
        }
        // Only where it meets the box is its place there within reach of an index.
        (at_m < end_m).then(|| {
            let cell = std::array::from_fn(|axis| self.cell_at(axis, at_m));
            (Place { at_m, cell }, end_m)
        })
    }

    /// Where the ray leaves the cube of 2^`levels` cells' side, aligned as those of coarser levels are, that holds `cell`.
    #[inline(always)]
    pub(super) fn beyond(&self, cell: [i32; 3], levels: u32) -> Place {
        let border = cell.map(|i| (i | ((1 << levels) - 1)) + 1);
        let passes_m: [f64; 3] = std::array::from_fn(|axis| self.border_m(axis, border[axis]));
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        let at_m = smaller(smaller(passes_m[0], passes_m[1]), passes_m[2]);
        let cell =
            std::array::from_fn(
                |axis| {
                    if passes_m[axis] <= at_m { border[axis] } else { self.cell_at(axis, at_m) }
                },
            );
        Place { at_m, cell }
    }

    /// Distance at which the ray passes the border below cell `index` of an axis, meters.
    #[inline(always)]
    fn border_m(&self, axis: usize, index: i32) -> f64 {
        (f64::from(index) - self.origin[axis]) * self.m_a_cell[axis]
    }

    /// Index of the cell that the ray is in at `at_m`: the last whose lower border it has passed.
    #[inline(always)]
    fn cell_at(&self, axis: usize, at_m: f64) -> i32 {
        let at = self.origin[axis] + at_m * self.cells_a_m[axis];
        let index = (at - 0.5 + ROUNDS).to_bits() as i32;
        let within = at - f64::from(index);
        if within < NEAR_BORDER || within > 1.0 - NEAR_BORDER {
            return self.cell_near_border(axis, at_m, index);
        }
        index
    }

    #[cold]
    fn cell_near_border(&self, axis: usize, at_m: f64, mut index: i32) -> i32 {
        if self.m_a_cell[axis].is_infinite() {
            return self.origin[axis].floor() as i32;
        }
        while self.border_m(axis, index) > at_m {
            index -= 1;
        }
        while self.border_m(axis, index + 1) <= at_m {
            index += 1;
        }
        index
    }
}
