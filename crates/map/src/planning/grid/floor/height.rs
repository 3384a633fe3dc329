//! The floor as heights, column by column.

use hashbrown::HashMap;

use super::regions::around;
use crate::util::StopSignal;

/// Columns between two checks of the stop signal.
const COLUMNS_PER_STOP_CHECK: usize = 4096;
/// Sizes of squares: the largest hold all columns that voxels can have.
const SQUARES_MAX: usize = 30;

/// Voxels without a gap from the floor down, from which on they are the face of a step, meters, and no floor alone:
/// more than noise and errors of poses make a floor thick.
const FACE_M: f64 = 0.2;

/// How high the floor is, for each column of voxels of a level.
///
/// A band counts from there, but at a step from its foot, so that the step itself is in the band: in a column that is
/// more than a voxel higher than the floor of one beside it, and in one that has voxels without a gap far down.
///
/// A column that the floor does not reach, as below a wall, has the height of a column near it that it does: the
/// nearest of those that stand for the squares of 2^n x 2^n columns around it, with the least n at which there are any.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    heights: HashMap<[i32; 2], Height>,
    /// At n - 1 a column of the floor for each square of 2^n x 2^n columns that has one: the first.
    squares: Vec<HashMap<[i32; 2], [i32; 2]>>,
    /// The first column, that stands for all of them.
    first: Option<[i32; 2]>,
    /// The lowest base and the highest floor.
    range: [i32; 2],
}

/// Heights in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::planning::grid) struct Height {
    /// The index of the first voxel above the floor.
    pub(in crate::planning::grid) floor: i32,
    /// The index of the voxel that a band begins with: that one, or a lower one at a step.
    pub(in crate::planning::grid) base: i32,
}

impl Floor {
    /// The floor that has the tops of these voxels of side `voxel_m`, each with the lowest z of the voxels without a
    /// gap from there down; of two in one column that of the first. Once stopped, it lacks some.
    pub(in crate::planning::grid) fn of(
        voxel_m: f64,
        columns: impl Iterator<Item = ([i32; 3], i32)>,
        stop: StopSignal<'_>,
    ) -> Self {
        let face = ((FACE_M / voxel_m).round() as i32).max(2);
        let mut heights = HashMap::new();
        for ([x, y, z], foot) in stop.paced(columns, COLUMNS_PER_STOP_CHECK) {
            let base = if z - foot >= face { foot + 1 } else { z + 1 };
            heights.entry([x, y]).or_insert(Height { floor: z + 1, base });
        }
        lower_at_steps(&mut heights, stop);
        let low = heights.values().map(|height| height.base).min().unwrap_or_default();
        let high = heights.values().map(|height| height.floor).max().unwrap_or_default();
        let mut below: Vec<[i32; 2]> = heights.keys().copied().collect();
        below.sort_unstable();
        let first = below.first().copied();
        let mut squares = Vec::new();
        while below.len() > 1 && squares.len() < SQUARES_MAX && !stop.is_stopped() {
            let up = squares.len() as u32 + 1;
            let mut square: HashMap<[i32; 2], [i32; 2]> = HashMap::new();
            below.retain(|column| {
                let is_new = !square.contains_key(&column.map(|i| i >> up));
                square.entry(column.map(|i| i >> up)).or_insert(*column);
                is_new
            });
            squares.push(square);
        }
        Self { heights, squares, first, range: [low, high] }
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        let squares: usize = self.squares.iter().map(HashMap::allocation_size).sum();
        size_of::<Self>() + self.heights.allocation_size() + squares
    }

    /// The heights in a column that the floor reaches.
    pub(in crate::planning::grid) fn within(&self, column: [i32; 2]) -> Option<Height> {
        self.heights.get(&column).copied()
    }

    /// The index of the first voxel above the floor near a column that it does not reach; 0 of a floor without a
    /// column.
    pub(in crate::planning::grid) fn near(&self, column: [i32; 2]) -> i32 {
        let near = |n: usize| {
            let at = column.map(|i| i >> n);
            let squares = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [at[0] + dx, at[1] + dy]));
            let columns = squares.filter_map(|square| match n {
                0 => self.heights.contains_key(&square).then_some(square),
                _ => self.squares[n - 1].get(&square).copied(),
            });
            columns.min_by_key(|of| (distance_squared(*of, column), *of))
        };
        let nearest = (0..=self.squares.len()).find_map(near);
        nearest.or(self.first).map_or(0, |of| self.heights[&of].floor)
    }

    /// The lowest index of a voxel that a band begins with, and the highest.
    pub(in crate::planning::grid) fn range(&self) -> [i32; 2] {
        self.range
    }
}

/// Has bands begin at the foot of steps: where the floor of a column beside is more than a voxel lower, which no slope
/// that can be driven is.
fn lower_at_steps(heights: &mut HashMap<[i32; 2], Height>, stop: StopSignal<'_>) {
    let mut lowered = Vec::new();
    for (column, height) in stop.paced(heights.iter(), COLUMNS_PER_STOP_CHECK) {
        let beside = around(*column).into_iter().filter_map(|beside| heights.get(&beside));
        let low = beside.map(|beside| beside.floor).min().unwrap_or(height.floor);
        if height.floor - low > 1 && low < height.base {
            lowered.push((*column, low));
        }
    }
    for (column, low) in lowered {
        if let Some(height) = heights.get_mut(&column) {
            height.base = low;
        }
    }
}

fn distance_squared(from: [i32; 2], to: [i32; 2]) -> i128 {
    (0..2).map(|axis| i128::from(from[axis]) - i128::from(to[axis])).map(|apart| apart * apart).sum()
}

#[cfg(test)]
impl Floor {
    /// The columns that the floor reaches.
    pub(in crate::planning::grid) fn columns(&self) -> impl Iterator<Item = [i32; 2]> {
        self.heights.keys().copied()
    }
}
