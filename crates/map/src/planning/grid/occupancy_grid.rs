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
    /// Height of the top of the highest voxel of each cell that reaches into the band, meters of the map frame, which
    /// may lie above the band by less than a voxel; NaN for a cell without one.
    pub tops_m: Vec<f32>,
    /// Whether cell i is free, as `occupied`, where that was asked for: a cell is unknown that is neither. Where it was
    /// not, the grid does not tell what was seen.
    pub free: Option<Vec<u64>>,
    /// The lowest and the highest floor of these cells, meters of the map frame, where the band counts from the floor
    /// and the floor reaches any of them.
    pub floor_m: Option<[f64; 2]>,
}

impl Grid {
    /// A grid of `size` cells without anything in them; where `tells_unknown`, all of them unknown.
    pub fn empty(cell_m: f64, origin_m: [f64; 2], size: [usize; 2], tells_unknown: bool) -> Self {
        let cells = size[0] * size[1];
        let none = || vec![0; cells.div_ceil(64)];
        let free = tells_unknown.then(none);
        Self { cell_m, origin_m, size, occupied: none(), tops_m: vec![f32::NAN; cells], free, floor_m: None }
    }

    /// Puts a part of this grid in, whose first cell is the cell `first` of this one; false where it does not lie
    /// within, and nothing is put in.
    pub fn put(&mut self, first: [usize; 2], part: &Self) -> bool {
        let fits =
            |axis: usize| first[axis].checked_add(part.size[axis]).is_some_and(|end| end <= self.size[axis]);
        if !(fits(0) && fits(1)) {
            return false;
        }
        self.floor_m = match (self.floor_m, part.floor_m) {
            (Some([low, high]), Some([part_low, part_high])) => {
                Some([low.min(part_low), high.max(part_high)])
            }
            (known, of_part) => known.or(of_part),
        };
        let bit = |words: &[u64], number: usize| words[number / 64] >> (number % 64) & 1;
        for (y, x) in (0..part.size[1]).flat_map(|y| (0..part.size[0]).map(move |x| (y, x))) {
            let from = y * part.size[0] + x;
            let to = (first[1] + y) * self.size[0] + first[0] + x;
            self.tops_m[to] = part.tops_m[from];
            self.occupied[to / 64] |= bit(&part.occupied, from) << (to % 64);
            if let (Some(free), Some(is_free)) = (&mut self.free, &part.free) {
                free[to / 64] |= bit(is_free, from) << (to % 64);
            }
        }
        true
    }

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
