//! A leaf of a tree, and its place in the order of leaves.

/// Levels of a tree above its finest cells.
pub(super) const DEPTH: u32 = 16;
/// Voxels that are made of a tree, at most: a few bytes of a file claim as many as the tree is large.
pub const VOXELS_MAX: u64 = 1 << 28;
/// Smallest index of a finest cell.
pub const CELL_INDEX_MIN: i32 = -(1 << (DEPTH - 1));
/// Largest index of a finest cell.
pub const CELL_INDEX_MAX: i32 = (1 << (DEPTH - 1)) - 1;

/// What a tree knows of a cell; unknown ones are not in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CellState {
    /// Seen through.
    Free,
    /// Something is there.
    Occupied,
}

/// A cell of one state.
///
/// Cell i j k of level n spans `[i, i + 1) * 2^n` finest cells in x, and so on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Leaf {
    /// The cell's indices among those of its level.
    pub index: [i32; 3],
    /// 0 for the finest cells, at most 15.
    pub level: u32,
    /// What is known of it.
    pub state: CellState,
}

/// The first finest cell of a leaf as its path from the root: three bits a level, the root's child highest.
///
/// Files have leaves in ascending order of it.
pub(super) type Code = u64;

/// Number of finest cells in a cell of a level.
pub(super) fn cells_of(level: u32) -> u64 {
    1 << (3 * level)
}

impl Leaf {
    /// The leaf's first finest cell; none where the leaf lies outside of every tree.
    pub(super) fn code(&self) -> Option<Code> {
        let first = CELL_INDEX_MIN >> self.level;
        let is_inside = |i: &i32| (first..-first).contains(i);
        (self.level < DEPTH && self.index.iter().all(is_inside)).then(|| {
            let [x, y, z] = self.index.map(|i| spread((i - first).cast_unsigned() << self.level));
            x | y << 1 | z << 2
        })
    }

    /// The leaf of a level that begins with a finest cell.
    pub(super) fn at(code: Code, level: u32, state: CellState) -> Self {
        let first = CELL_INDEX_MIN >> level;
        let index = [0, 1, 2].map(|axis| (gathered(code >> axis) >> level).cast_signed() + first);
        Self { index, level, state }
    }
}

/// The 16 bits of a key, three places apart.
fn spread(key: u32) -> u64 {
    const STEPS: [(u32, u64); 4] = [
        (16, 0x00ff_0000_ff00_00ff),
        (8, 0xf00f_00f0_0f00_f00f),
        (4, 0x30c3_0c30_c30c_30c3),
        (2, 0x9249_2492_4924_9249),
    ];
    STEPS.iter().fold(u64::from(key), |bits, (shift, mask)| (bits | bits << shift) & mask)
}

/// The inverse of [`spread`], whatever lies between the bits.
fn gathered(code: u64) -> u32 {
    (0..DEPTH).map(|bit| (code >> (3 * bit) & 1) << bit).sum::<u64>() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_code_of_a_leaf_is_reversible(index: [i16; 3], level in 0..DEPTH) {
            let index = index.map(|i| i32::from(i) >> level);
            let leaf = Leaf { index, level, state: CellState::Free };
            prop_assert_eq!(Leaf::at(leaf.code().unwrap(), level, CellState::Free), leaf);
        }
    }

    #[test]
    fn children_follow_one_another_by_x_then_y_then_z() {
        let code = |index| Leaf { index, level: 0, state: CellState::Occupied }.code();
        let origin = code([0; 3]).unwrap();
        assert_eq!(origin, 7 << 45);
        assert_eq!([[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(code), [1, 2, 4].map(|child| Some(origin + child)));
        assert_eq!(code([CELL_INDEX_MIN; 3]), Some(0));
        assert_eq!(code([CELL_INDEX_MAX; 3]), Some((1 << 48) - 1));
    }

    #[test]
    fn a_cell_outside_of_every_tree_has_no_code() {
        for (index, level) in
            [([1 << 15, 0, 0], 0), ([0, -(1 << 15) - 1, 0], 0), ([0, 0, 1], 15), ([0; 3], 16)]
        {
            assert_eq!(Leaf { index, level, state: CellState::Free }.code(), None, "{index:?} of {level}");
        }
    }
}
