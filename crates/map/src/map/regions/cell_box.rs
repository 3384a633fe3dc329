//! Boxes of whole cells of a level.

use super::region::Region;
use crate::voxel::{INDEX_MAX, INDEX_MIN, Lattice};

/// The cells of one level from `min` to `max`, both within; none where an axis has `max` below `min`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBox {
    min: [i32; 3],
    max: [i32; 3],
}

impl CellBox {
    /// The cells of `level` whose centers lie from `min_m` to `max_m` (map frame, meters), borders included. Infinite
    /// sides end where the level's indices do.
    pub fn of_centers(min_m: [f64; 3], max_m: [f64; 3], lattice: &Lattice, level: u32) -> Self {
        let (first, end) = (INDEX_MIN >> level, (INDEX_MAX >> level) + 1);
        let center = |i| lattice.center_along_m(i, level);
        let at_least = |m: f64| first_without(first, end, |i| center(i) < m);
        let beyond = |m: f64| first_without(first, end, |i| center(i) <= m);
        Self { min: min_m.map(at_least), max: max_m.map(|m| beyond(m) - 1) }
    }

    /// The first cell's indices.
    pub fn min(&self) -> [i32; 3] {
        self.min
    }

    /// Number of cells along each axis.
    pub fn size(&self) -> [usize; 3] {
        let along = |axis: usize| i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1;
        std::array::from_fn(|axis| usize::try_from(along(axis)).unwrap_or_default())
    }

    /// Number of cells; `u64::MAX` where there are more.
    pub fn cells(&self) -> u64 {
        self.size().iter().fold(1, |cells: u64, &size| cells.saturating_mul(size as u64))
    }

    /// This box with `by` more cells on each side, also beyond the level's indices; an empty one stays empty.
    pub fn grown(&self, by: i32) -> Self {
        if self.cells() == 0 {
            return *self;
        }
        Self { min: self.min.map(|i| i - by), max: self.max.map(|i| i + by) }
    }

    /// The cubes of the cells as a region.
    pub fn region(&self, lattice: &Lattice, level: u32) -> Region {
        let resolution_m = lattice.resolution_m(level);
        let (min, max) = (self.min, self.max);
        Region::Box {
            min_m: min.map(|i| f64::from(i) * resolution_m),
            max_m: max.map(|i| (f64::from(i) + 1.0) * resolution_m),
        }
    }

    /// The centers of the eight finest voxels at the corners, of cells of `level`.
    pub fn corners_m(&self, lattice: &Lattice, level: u32) -> [[f64; 3]; 8] {
        let half_m = lattice.resolution_m(0) / 2.0;
        let low = |i: i32| f64::from(i) * lattice.resolution_m(level) + half_m;
        let high = |i: i32| (f64::from(i) + 1.0) * lattice.resolution_m(level) - half_m;
        std::array::from_fn(|corner| {
            std::array::from_fn(|axis| {
                if corner >> axis & 1 == 0 { low(self.min[axis]) } else { high(self.max[axis]) }
            })
        })
    }
}

/// The first of `first..end` that `is_before` is not true of, where it is true of those before it alone.
fn first_without(mut first: i32, mut end: i32, is_before: impl Fn(i32) -> bool) -> i32 {
    while first < end {
        let middle = first + (end - first) / 2;
        if is_before(middle) { first = middle + 1 } else { end = middle }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_cells_of_a_box_are_those_whose_centers_it_holds(
            resolution_m in 0.001f64..2.0,
            level in 0u32..12,
            low in prop::array::uniform3(-30i32..30),
            size in prop::array::uniform3(0i32..8),
            off in prop::array::uniform2(0u8..3),
        ) {
            // On centers, on borders, and beside both.
            let lattice = Lattice::new(resolution_m, 12).unwrap();
            let side = lattice.resolution_m(level);
            let at = |i: i32, off: u8| (f64::from(i) + [0.0, 0.5, 0.77][usize::from(off)]) * side;
            let (min_m, max_m) = (low.map(|i| at(i, off[0])), [0, 1, 2].map(|a| at(low[a] + size[a], off[1])));
            prop_assume!((0..3).all(|axis| min_m[axis] <= max_m[axis]));
            let cells = CellBox::of_centers(min_m, max_m, &lattice, level);
            let region = Region::cuboid(min_m, max_m).unwrap();
            for axis in 0..3 {
                let held = |i: &i32| {
                    let mut point = min_m;
                    point[axis] = lattice.center_along_m(*i, level);
                    region.contains(point)
                };
                let expected: Vec<i32> = (low[axis] - 2..low[axis] + size[axis] + 3).filter(held).collect();
                let found: Vec<i32> = (cells.min[axis]..=cells.max[axis]).collect();
                prop_assert_eq!(found, expected);
            }
            prop_assert_eq!(cells.cells() as usize, cells.size().iter().product::<usize>());
        }
    }

    #[test]
    fn a_box_without_end_ends_where_indices_do() {
        let lattice = Lattice::new(0.1, 12).unwrap();
        for level in [0, 3, 11] {
            let cells = CellBox::of_centers([f64::NEG_INFINITY; 3], [f64::INFINITY; 3], &lattice, level);
            assert_eq!((cells.min, cells.max), ([INDEX_MIN >> level; 3], [INDEX_MAX >> level; 3]));
            assert_eq!(cells.cells(), 1 << (3 * (21 - level)));
        }
        let nowhere = CellBox::of_centers([1e300; 3], [f64::INFINITY; 3], &lattice, 0);
        assert_eq!((nowhere.cells(), nowhere.size(), nowhere.grown(5)), (0, [0; 3], nowhere));
    }

    #[test]
    fn corners_are_the_outermost_finest_voxels() {
        let lattice = Lattice::new(1.0, 4).unwrap();
        let cells = CellBox::of_centers([-4.0, 0.0, 0.0], [4.0, 4.0, 4.0], &lattice, 2);
        assert_eq!((cells.min(), cells.size()), ([-1, 0, 0], [2, 1, 1]));
        let corners = cells.corners_m(&lattice, 2);
        assert_eq!((corners[0], corners[7]), ([-3.5, 0.5, 0.5], [3.5, 3.5, 3.5]));
        let grown = cells.grown(1).region(&lattice, 2);
        assert_eq!(grown, Region::cuboid([-8.0, -4.0, -4.0], [8.0, 8.0, 8.0]).unwrap());
    }
}
