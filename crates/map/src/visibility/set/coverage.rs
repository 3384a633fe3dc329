//! Which viewpoints may have looked into a part of the map.

use std::collections::BTreeMap;

use hashbrown::HashMap;

use crate::geometry::Pose;
use crate::visibility::image::RangeImage;

/// How many cells a viewpoint reaches in each direction, at most.
const CELLS_OF_REACH: f64 = 8.0;
/// Largest index of a cell that a viewpoint is in, and some more.
const CELL_INDEX_MAX: f64 = (1 << 30) as f64;
/// Bytes of a cell in the index of which one viewpoint alone takes care: a list in a table that is half full, with room
/// for four.
const INDEX_BYTES: usize = 112;
/// Steps along a ray within a cell.
const STEPS_A_CELL: f64 = 2.0;

/// A cube of a grid in the map frame: its index along each axis.
type CellIndex = [i32; 3];
/// The place of a viewpoint in its set.
pub(super) type Slot = u32;

/// The viewpoints that may have looked into each cell of space, so that a point asks few of them.
///
/// Cells are cubes, an eighth as wide as a viewpoint reaches or up to twice that: a power of two in meters, with a grid
/// for each. So a viewpoint is in some hundred cells, whether it saw a room or a street. A cell names every viewpoint
/// that saw a point of it, first those that saw most.
#[derive(Debug, Clone, Default)]
pub(super) struct CoverageIndex {
    /// By the exponent of the cells' side.
    grids: BTreeMap<i32, HashMap<CellIndex, Vec<Entry>>>,
}

/// A viewpoint in a cell.
#[derive(Debug, Clone, Copy)]
struct Entry {
    slot: Slot,
    /// Steps of its rays in the cell.
    weight: u32,
}

/// The cells that a viewpoint looked into.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coverage {
    exponent: i32,
    cells: Vec<(CellIndex, u32)>,
}

impl Coverage {
    /// The cells with a point that was seen from `map_from_sensor`, as `image` tells, and some beside.
    pub(super) fn of(map_from_sensor: &Pose, image: &RangeImage) -> Self {
        let origin: [f64; 3] = map_from_sensor.translation.vector.into();
        let in_map = |offset: [f32; 3]| map_from_sensor * nalgebra::Point3::from(offset.map(f64::from));
        let ends: Vec<[f64; 3]> = image.seen().map(|offset| in_map(offset).into()).collect();
        let distance =
            |end: &[f64; 3]| (0..3).map(|axis| (end[axis] - origin[axis]).powi(2)).sum::<f64>().sqrt();
        let extent_m = ends.iter().map(distance).fold(0.0, f64::max).max(f64::from(f32::MIN_POSITIVE));
        // Indices of cells are of 32 bits, however far away and however small a thing was seen.
        let far_m = origin.iter().fold(extent_m, |far, c| far.max(c.abs()));
        let side_m = (extent_m / CELLS_OF_REACH).max(far_m / CELL_INDEX_MAX);
        let exponent = side_m.log2().ceil() as i32;
        let side_m = 2f64.powi(exponent);
        let mut grid = LocalGrid::around(origin, extent_m, side_m);
        let half_pixel = f64::from(image.pitch()) * std::f64::consts::FRAC_1_SQRT_2;
        for end in &ends {
            let steps = (distance(end) / side_m * STEPS_A_CELL).ceil().max(1.0);
            // A ball around each step holds the frustum of the pixel up to the next.
            let half_step_m = distance(end) / steps / 2.0;
            for step in 0..steps as usize {
                let along = (step as f64 + 0.5) / steps;
                let wide_m = distance(end) * (along + 0.5 / steps) * half_pixel;
                let center = std::array::from_fn(|axis| origin[axis] + (end[axis] - origin[axis]) * along);
                grid.mark(center, half_step_m.hypot(wide_m));
            }
        }
        Self { exponent, cells: grid.marked() }
    }

    /// Bytes of memory, with those of the index.
    pub(super) fn memory_bytes(&self) -> usize {
        self.cells.len() * (size_of::<(CellIndex, u32)>() + INDEX_BYTES)
    }

    /// The cells, as boxes of the map frame: the smallest and the largest coordinates, meters.
    pub(super) fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.cells.iter().map(|(cell, _)| box_m(self.exponent, *cell))
    }
}

/// A cell as a box of the map frame: the smallest and the largest coordinates, meters.
fn box_m(exponent: i32, cell: CellIndex) -> [[f64; 3]; 2] {
    let side_m = 2f64.powi(exponent);
    [0.0, 1.0].map(|end| cell.map(|i| (f64::from(i) + end) * side_m))
}

impl CoverageIndex {
    pub(super) fn insert(&mut self, slot: Slot, coverage: &Coverage) {
        let grid = self.grids.entry(coverage.exponent).or_default();
        for &(cell, weight) in &coverage.cells {
            let entries = grid.entry(cell).or_default();
            let place = entries.partition_point(|entry| entry.weight >= weight);
            entries.insert(place, Entry { slot, weight });
        }
    }

    pub(super) fn remove(&mut self, slot: Slot, coverage: &Coverage) {
        let Some(grid) = self.grids.get_mut(&coverage.exponent) else { return };
        for (cell, _) in &coverage.cells {
            if let Some(entries) = grid.get_mut(cell) {
                entries.retain(|entry| entry.slot != slot);
                if entries.is_empty() {
                    grid.remove(cell);
                }
            }
        }
        if grid.is_empty() {
            self.grids.remove(&coverage.exponent);
        }
    }

    /// The viewpoints that may have looked at a point between two corners of the map, each once.
    pub(super) fn within(&self, low_m: [f64; 3], high_m: [f64; 3]) -> Vec<Slot> {
        let mut slots = Vec::new();
        for (&exponent, grid) in &self.grids {
            let [low, high] =
                [low_m, high_m].map(|at_m| at_m.map(|c| (c / 2f64.powi(exponent)).floor() as i32));
            let mut take =
                |entries: &[Entry]| slots.extend(entries.iter().map(|entry| (entry.weight, entry.slot)));
            let count: f64 = (0..3).map(|axis| f64::from(high[axis]) - f64::from(low[axis]) + 1.0).product();
            if count > grid.len() as f64 {
                let is_inside =
                    |cell: &CellIndex| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&cell[axis]));
                grid.iter().filter(|(cell, _)| is_inside(cell)).for_each(|(_, entries)| take(entries));
                continue;
            }
            let cells = (low[2]..=high[2]).flat_map(|z| (low[1]..=high[1]).map(move |y| (y, z)));
            for (y, z) in cells {
                (low[0]..=high[0]).filter_map(|x| grid.get(&[x, y, z])).for_each(|entries| take(entries));
            }
        }
        // Each once, and first those that saw most.
        slots.sort_unstable_by_key(|&(weight, slot)| (slot, std::cmp::Reverse(weight)));
        slots.dedup_by_key(|(_, slot)| *slot);
        slots.sort_unstable_by_key(|&(weight, slot)| (std::cmp::Reverse(weight), slot));
        slots.into_iter().map(|(_, slot)| slot).collect()
    }

    /// The cells that a viewpoint looked into, each once.
    pub(super) fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.grids.iter().flat_map(|(&exponent, grid)| grid.keys().map(move |cell| box_m(exponent, *cell)))
    }

    /// True where a viewpoint may have looked into a box; of one that is large against the cells this is always said.
    pub(super) fn may_cover(&self, low_m: [f64; 3], high_m: [f64; 3]) -> bool {
        const CELLS_MAX: i64 = 64;
        self.grids.iter().any(|(&exponent, grid)| {
            let cell = |c: f64| (c / 2f64.powi(exponent)).floor() as i32;
            let [low, high] = [low_m.map(cell), high_m.map(cell)];
            let count: i64 = (0..3).map(|axis| i64::from(high[axis]) - i64::from(low[axis]) + 1).product();
            count > CELLS_MAX
                || (low[2]..=high[2]).any(|z| {
                    (low[1]..=high[1]).any(|y| (low[0]..=high[0]).any(|x| grid.contains_key(&[x, y, z])))
                })
        })
    }

    /// The viewpoints that may have looked at a point of the map, first those that saw most of what is around it.
    #[inline]
    pub(super) fn around(&self, point_m: [f64; 3]) -> impl Iterator<Item = Slot> {
        self.grids.iter().flat_map(move |(&exponent, grid)| {
            let cell = point_m.map(|c| (c / 2f64.powi(exponent)).floor() as i32);
            grid.get(&cell).into_iter().flatten().map(|entry| entry.slot)
        })
    }
}

/// The cells around a viewpoint, as far as it reaches.
struct LocalGrid {
    side_m: f64,
    first: CellIndex,
    count: [usize; 3],
    /// One more than the steps in each cell; 0 of one that nothing marked.
    marks: Vec<u32>,
}

impl LocalGrid {
    fn around(origin: [f64; 3], extent_m: f64, side_m: f64) -> Self {
        // Balls around rays reach beyond their ends.
        let extent_m = extent_m + 2.0 * side_m;
        let first = origin.map(|c| ((c - extent_m) / side_m).floor() as i32);
        let end = origin.map(|c| ((c + extent_m) / side_m).floor() as i32 + 1);
        let count: [usize; 3] = std::array::from_fn(|axis| (end[axis] - first[axis]) as usize);
        Self { side_m, first, count, marks: vec![0; count.iter().product()] }
    }

    /// Marks the cells of a ball, and counts the one of its center.
    fn mark(&mut self, center: [f64; 3], radius: f64) {
        let along = |axis: usize, c: f64| ((c / self.side_m).floor() as i32 - self.first[axis]) as usize;
        let middle: [usize; 3] = std::array::from_fn(|axis| along(axis, center[axis]));
        let low: [usize; 3] = std::array::from_fn(|axis| along(axis, center[axis] - radius));
        let high: [usize; 3] = std::array::from_fn(|axis| along(axis, center[axis] + radius));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let mark = &mut self.marks[(z * self.count[1] + y) * self.count[0] + x];
                    *mark = (*mark).max(1);
                }
            }
        }
        self.marks[(middle[2] * self.count[1] + middle[1]) * self.count[0] + middle[0]] += 1;
    }

    fn marked(&self) -> Vec<(CellIndex, u32)> {
        let marked = self.marks.iter().enumerate().filter(|(_, mark)| **mark > 0);
        let cell = |(place, mark): (usize, &u32)| {
            let [x, rest] = [place % self.count[0], place / self.count[0]];
            let [y, z] = [rest % self.count[1], rest / self.count[1]];
            let index = [x, y, z];
            (std::array::from_fn(|axis| self.first[axis] + index[axis] as i32), mark - 1)
        };
        marked.map(cell).collect()
    }
}
