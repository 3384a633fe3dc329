//! One ray through a lattice of cells: which cells it meets, and where (Amanatides and Woo, *A Fast Voxel Traversal
//! Algorithm for Ray Tracing*, 1987).

use crate::map::CellBounds;

/// The three axes, and one along which no ray moves: four of a kind go through one vector register, or two.
const LANES: usize = 4;

/// A ray in cells, each axis along which it descends turned over, so that it ascends along all of them.
///
/// It passes the border below cell i of an axis at `(i - origin) * m_a_cell` meters, computed in just this way wherever
/// it is needed. So a leap over many cells ends in the cell that single steps would have led to, bit for bit.
///
/// Turned over, cell i is cell -1 - i, and a border belongs to the cell that the ray moves into.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Where it begins, cells.
    origin: [f64; LANES],
    /// Meters along the ray from border to border of an axis; infinite along an axis on which it does not move.
    m_a_cell: [f64; LANES],
    /// Cells passed along each axis, a meter along the ray.
    cells_a_m: [f64; LANES],
    /// -1 for an axis that is turned over, 0 for others: exclusive or with it turns an index.
    turned: [i32; LANES],
}

/// A place on a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Distance from the ray's begin, meters.
    pub(super) at_m: f64,
    /// The cell, turned as the ray is.
    cell: [i32; LANES],
}

/// How near to a border, in cells, the cell of a place is decided by where the ray passes the border: far more than
/// rounding moves a place, which is at most 2^-29 of a cell.
const NEAR_BORDER: f64 = 1e-6;
/// Adding it rounds a number below 2^31 to a whole one, which is then the sum's low 32 bits.
const ROUNDS: f64 = 1.5 * (1u64 << 52) as f64;

impl Ray {
    /// The ray from `origin` (cells) along the unit vector `direction`, through cells of side `cell_m`.
    #[inline(always)]
    pub(super) fn new([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3], cell_m: f64) -> Self {
        // In the middle of a cell, no border is ever near along the fourth axis.
        let (origin, direction) = ([x, y, z, 0.5], [dx, dy, dz, 0.0]);
        let cells_a_m = 1.0 / cell_m;
        Self {
            origin: std::array::from_fn(|i| if direction[i] < 0.0 { -origin[i] } else { origin[i] }),
            m_a_cell: direction.map(|d: f64| cell_m / d.abs()),
            cells_a_m: direction.map(|d| d.abs() * cells_a_m),
            turned: direction.map(|d| -i32::from(d < 0.0)),
        }
    }

    /// The cell of a place as the map counts cells.
    #[inline(always)]
    pub(super) fn cell(&self, place: &Place) -> [i32; 3] {
        std::array::from_fn(|axis| place.cell[axis] ^ self.turned[axis])
    }

    /// Where the ray meets a box, and the distance at which it leaves it or ends, meters: none where it does not meet
    /// it before `range_m`.
    #[inline(always)]
    pub(super) fn clipped(&self, bounds: &CellBounds, range_m: f64) -> Option<(Place, f64)> {
        let (mut at_m, mut end_m) = (0.0, range_m);
        for axis in 0..3 {
            let (first, end) = self.turned_range(bounds, axis);
            // NaN, on a border along which the ray runs, bounds nothing.
            at_m = f64::max(at_m, self.border_m(axis, first));
            end_m = f64::min(end_m, self.border_m(axis, end));
        }
        // Only where it meets the box is its place there within reach of an index.
        (at_m < end_m).then(|| (Place { at_m, cell: self.cells_at(at_m) }, end_m))
    }

    /// Where the ray leaves the cube of 2^`levels` cells' side, aligned as voxels of coarser levels are, that holds a
    /// place.
    #[inline(always)]
    pub(super) fn beyond(&self, place: &Place, levels: u32) -> Place {
        self.beyond_borders(place.cell.map(|i| (i | ((1 << levels) - 1)) + 1))
    }

    /// Where the ray leaves a box that holds a place; none where it does not.
    #[inline(always)]
    pub(super) fn out_of(&self, place: &Place, clear: &CellBounds) -> Option<Place> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.turned_range(clear, axis));
        let is_within = |(first, end): (i32, i32), axis: usize| (first..end).contains(&place.cell[axis]);
        let is_inside = is_within(x, 0) & is_within(y, 1) & is_within(z, 2);
        is_inside.then(|| self.beyond_borders([x.1, y.1, z.1, i32::MAX]))
    }

    /// The cells of a box along an axis, turned as the ray is: the first, and the one past the last.
    #[inline(always)]
    fn turned_range(&self, of: &CellBounds, axis: usize) -> (i32, i32) {
        match self.turned[axis] {
            0 => (of.first[axis], of.end[axis]),
            _ => (-of.end[axis], -of.first[axis]),
        }
    }

    /// Where the ray first passes one of these borders, each that below a cell of an axis; all lie before it.
    #[inline(always)]
    fn beyond_borders(&self, border: [i32; LANES]) -> Place {
        let passes_m: [f64; LANES] = std::array::from_fn(|axis| self.border_m(axis, border[axis]));
        let at_m = smaller(smaller(passes_m[0], passes_m[1]), smaller(passes_m[2], passes_m[3]));
        let (mut cell, mut is_near) = ([0; LANES], false);
        for axis in 0..LANES {
            let passes = passes_m[axis] <= at_m;
            let (index, is_near_border) = self.cell_away_from_border(axis, at_m);
            is_near |= !passes & is_near_border;
            cell[axis] = if passes { border[axis] } else { index };
        }
        if is_near {
            cell = self.cells_at(at_m);
        }
        Place { at_m, cell }
    }

    /// Distance at which the ray passes the border below cell `index` of an axis, meters.
    #[inline(always)]
    fn border_m(&self, axis: usize, index: i32) -> f64 {
        (f64::from(index) - self.origin[axis]) * self.m_a_cell[axis]
    }

    /// Index of the cell that the ray is in at `at_m`, and whether a border is so near that it may be the neighbor's.
    #[inline(always)]
    fn cell_away_from_border(&self, axis: usize, at_m: f64) -> (i32, bool) {
        let at = self.origin[axis] + at_m * self.cells_a_m[axis];
        let rounded = at - 0.5 + ROUNDS;
        let from_middle = at - (rounded - ROUNDS) - 0.5;
        (rounded.to_bits() as i32, from_middle.abs() > 0.5 - NEAR_BORDER)
    }

    /// Indices of the cells that the ray is in at `at_m`: along each axis the last whose lower border it has passed.
    #[cold]
    fn cells_at(&self, at_m: f64) -> [i32; LANES] {
        std::array::from_fn(|axis| {
            if self.m_a_cell[axis].is_infinite() {
                return self.origin[axis].floor() as i32;
            }
            let (mut index, _) = self.cell_away_from_border(axis, at_m);
            while self.border_m(axis, index) > at_m {
                index -= 1;
            }
            while self.border_m(axis, index + 1) <= at_m {
                index += 1;
            }
            index
        })
    }
}

/// The smaller of two numbers: one instruction, as long as NaN does not matter.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
