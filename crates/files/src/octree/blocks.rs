//! The cells of a box in the order of files, block by block.

use mrol_map::voxel::{BLOCK_LEVELS, BLOCK_SIDE};

use super::leaf::{CELL_INDEX_MAX, CELL_INDEX_MIN, CellState, Code, DEPTH, Leaf, cells_of};

/// A cube of 8 x 8 x 8 finest cells: a block of voxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBlock {
    low: [i32; 3],
}

impl CellBlock {
    /// Its first cell.
    pub fn low(&self) -> [i32; 3] {
        self.low
    }

    /// Its cells, in the order of files.
    pub fn cells(self) -> impl Iterator<Item = [i32; 3]> {
        // Bits n, n + 3 and n + 6 are those of axis n.
        let along = |cell: i32, axis: usize| {
            let bits = cell >> axis;
            bits & 1 | bits >> 2 & 2 | bits >> 4 & 4
        };
        (0..BLOCK_SIDE.pow(3)).map(move |cell| [0, 1, 2].map(|axis| self.low[axis] + along(cell, axis)))
    }
}

/// The blocks that have a cell of a box, in the order of files. Holds the path to one of them.
#[derive(Debug)]
pub struct CellBlocks {
    low: [i32; 3],
    high: [i32; 3],
    /// What is left: nodes of the tree, the next one last.
    left: Vec<(Code, u32)>,
}

impl CellBlocks {
    /// The blocks of the box from one cell to another, both in it. Cells that no tree has are left out.
    pub fn within(low: [i32; 3], high: [i32; 3]) -> Self {
        let low = low.map(|i| i.max(CELL_INDEX_MIN));
        let high = high.map(|i| i.min(CELL_INDEX_MAX));
        let is_empty = low.iter().zip(high).any(|(low, high)| *low > high);
        Self { low, high, left: if is_empty { Vec::new() } else { vec![(0, DEPTH)] } }
    }

    /// How many blocks there are.
    pub fn count_all(&self) -> u64 {
        let along = |axis: usize| {
            let blocks = (self.high[axis] >> BLOCK_LEVELS) - (self.low[axis] >> BLOCK_LEVELS) + 1;
            blocks.max(0) as u64
        };
        along(0) * along(1) * along(2)
    }

    fn touches(&self, code: Code, level: u32) -> bool {
        // The root has no indices of its own.
        level == DEPTH || {
            let index = Leaf::at(code, level, CellState::Free).index;
            (0..3).all(|axis| {
                let range = self.low[axis] >> level..=self.high[axis] >> level;
                range.contains(&index[axis])
            })
        }
    }
}

impl Iterator for CellBlocks {
    type Item = CellBlock;

    fn next(&mut self) -> Option<CellBlock> {
        while let Some((code, level)) = self.left.pop() {
            if level == BLOCK_LEVELS {
                let block = Leaf::at(code, level, CellState::Free).index;
                return Some(CellBlock { low: block.map(|i| i << BLOCK_LEVELS) });
            }
            let below = level - 1;
            for child in (0..8).rev() {
                let code = code + child * cells_of(below);
                if self.touches(code, below) {
                    self.left.push((code, below));
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_of_a_box_come_once_and_in_the_order_of_files() {
        let (low, high) = ([-9, -1, 3], [12, 0, 30]);
        let blocks = CellBlocks::within(low, high);
        let count = blocks.count_all();
        assert_eq!(count, 4 * 2 * 4);
        let cells: Vec<[i32; 3]> = blocks.flat_map(CellBlock::cells).collect();
        assert_eq!(cells.len() as u64, count * 512);
        let code =
            |index: &[i32; 3]| Leaf { index: *index, level: 0, state: CellState::Free }.code().unwrap();
        assert!(cells.is_sorted_by(|one, next| code(one) < code(next)));
        let inside = |cell: &&[i32; 3]| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&cell[axis]));
        assert_eq!(cells.iter().filter(inside).count(), 22 * 2 * 28);
    }

    #[test]
    fn what_lies_beyond_a_tree_is_left_out() {
        assert_eq!(CellBlocks::within([40_000, 0, 0], [50_000, 0, 0]).count(), 0);
        let at_end = CellBlocks::within([CELL_INDEX_MAX, 0, 0], [i32::MAX, 0, 0]);
        assert_eq!((at_end.count_all(), at_end.count()), (1, 1));
    }
}
