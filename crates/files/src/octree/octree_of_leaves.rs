//! A tree in memory, pruned as it is made.

use super::leaf::{CELL_INDEX_MAX, CELL_INDEX_MIN, CellState, Code, DEPTH, Leaf, cells_of};

/// Bits of a level and a state below a leaf's code.
const BELOW_CODE: u32 = 8;

/// The leaves of a tree, ascending, pruned: eight of one state that make a node are one.
///
/// Takes 8 bytes a leaf.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Octree(Vec<PackedLeaf>);

/// A leaf in 64 bits, in the order of files.
///
/// ```text
/// bit 55 ......... 8 | 7 ........ 1 | 0
///     code           | level        | 1 of an occupied one
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PackedLeaf(u64);

/// Why a leaf cannot follow those of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LeafError {
    /// The leaf lies outside of every tree.
    #[error(
        "cell {index:?} of level {level} lies beyond an octree, whose finest cells have indices from {CELL_INDEX_MIN} to \
         {CELL_INDEX_MAX}"
    )]
    Outside {
        /// Its indices.
        index: [i32; 3],
        /// Its level.
        level: u32,
    },
    /// The leaf does not lie behind all before it.
    #[error("cell {index:?} of level {level} does not lie behind the leaf before it")]
    Order {
        /// Its indices.
        index: [i32; 3],
        /// Its level.
        level: u32,
    },
}

impl PackedLeaf {
    fn new(code: Code, level: u32, state: CellState) -> Self {
        Self(code << BELOW_CODE | u64::from(level) << 1 | u64::from(state == CellState::Occupied))
    }

    pub(super) fn code(self) -> Code {
        self.0 >> BELOW_CODE
    }

    pub(super) fn level(self) -> u32 {
        (self.0 >> 1 & 0x7f) as u32
    }

    pub(super) fn state(self) -> CellState {
        if self.0 & 1 == 1 { CellState::Occupied } else { CellState::Free }
    }

    /// One past its last finest cell.
    fn end(self) -> Code {
        self.code() + cells_of(self.level())
    }

    /// The leaf that this and seven others before it make, where this is the last child of a node.
    fn parent(self) -> Option<Self> {
        let (code, level) = (self.code(), self.level());
        // The root has children in every file.
        let is_last = code >> (3 * level) & 7 == 7 && level + 1 < DEPTH;
        is_last.then(|| Self::new(code - 7 * cells_of(level), level + 1, self.state()))
    }
}

impl std::fmt::Debug for PackedLeaf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Leaf::at(self.code(), self.level(), self.state()).fmt(f)
    }
}

impl Octree {
    /// The tree of leaves in any order, none of which lies in another.
    ///
    /// # Errors
    /// When a leaf lies outside of every tree, or in another one.
    pub fn of(leaves: impl IntoIterator<Item = Leaf>) -> Result<Self, LeafError> {
        let mut packed = Vec::new();
        for leaf in leaves {
            packed.push(Self::packed(leaf)?);
        }
        packed.sort_unstable();
        let mut tree = Self::default();
        packed.into_iter().try_for_each(|leaf| tree.push_packed(leaf))?;
        Ok(tree)
    }

    /// Adds a leaf behind all others, in the order of files: the first finest cells of leaves ascend as the interleaved
    /// bits of z, y and x.
    ///
    /// # Errors
    /// When the leaf lies outside of every tree, or not behind the others.
    pub fn push(&mut self, leaf: Leaf) -> Result<(), LeafError> {
        self.push_packed(Self::packed(leaf)?)
    }

    fn packed(leaf: Leaf) -> Result<PackedLeaf, LeafError> {
        let Leaf { index, level, state } = leaf;
        let code = leaf.code().ok_or(LeafError::Outside { index, level })?;
        Ok(PackedLeaf::new(code, level, state))
    }

    fn push_packed(&mut self, leaf: PackedLeaf) -> Result<(), LeafError> {
        if self.0.last().is_some_and(|last| leaf.code() < last.end()) {
            let Leaf { index, level, .. } = Leaf::at(leaf.code(), leaf.level(), leaf.state());
            return Err(LeafError::Order { index, level });
        }
        self.0.push(leaf);
        self.prune();
        Ok(())
    }

    /// Makes one leaf of the last eight, and so on upward, where they are the children of a node and of one state.
    fn prune(&mut self) {
        while let Some((last, before)) = self.0.split_last()
            && let Some(parent) = last.parent()
            && let Some(first) = before.len().checked_sub(7)
            // Leaves ascend and do not overlap: of one level, between these two, are all eight.
            && before[first..].iter().all(|leaf| leaf.level() == last.level() && leaf.state() == last.state())
            && before[first].code() == parent.code()
        {
            self.0.truncate(first);
            self.0.push(parent);
        }
    }

    /// The leaves, ascending in the order of files.
    pub fn leaves(&self) -> impl ExactSizeIterator<Item = Leaf> + '_ {
        self.0.iter().map(|leaf| Leaf::at(leaf.code(), leaf.level(), leaf.state()))
    }

    /// Number of leaves.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True of a tree of unknown cells alone.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn packed_leaves(&self) -> &[PackedLeaf] {
        &self.0
    }

    /// Number of nodes of the tree, leaves and the root among them.
    pub(super) fn nodes(&self) -> u64 {
        let mut nodes = self.0.len() as u64;
        let mut before: Option<PackedLeaf> = None;
        for leaf in &self.0 {
            // The root of a first leaf, and those of another branch than the last leaf's.
            let branch = before.map_or(DEPTH + 1, |before| {
                let differs = before.code() ^ leaf.code();
                (u64::BITS - differs.leading_zeros()).div_ceil(3)
            });
            nodes += u64::from(branch.saturating_sub(leaf.level() + 1));
            before = Some(*leaf);
        }
        nodes
    }
}
