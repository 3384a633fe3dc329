//! Blocks of 8 x 8 x 8 voxels: three levels of the map in one 512-bit mask.

use super::key::VoxelKey;
use super::moments::Moments;

/// Levels that one block's mask holds.
pub const BLOCK_LEVELS: u32 = 3;
/// Voxels along a block's side.
pub const BLOCK_SIDE: i32 = 1 << BLOCK_LEVELS;
const WORDS: usize = 8;

/// Position of a voxel in its block, 0..512, in Morton order.
///
/// ```text
/// bit 8 7 6 | 5 4 3 | 2 1 0
///     z y x | z y x | z y x
///     word  | byte  | bit      of the block's mask
/// ```
///
/// So the eight children of one voxel of the next level are one byte of the mask, and the 64 descendants of
/// one voxel two levels up are one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell(u16);

impl Cell {
    /// Spreads three bits b2 b1 b0 to bits 6, 3 and 0: one byte an entry.
    pub(crate) const SPREAD: u64 = 0x4948_4140_0908_0100;

    /// The block (a key three levels coarser) and the cell of the voxel at `index`.
    #[inline(always)]
    pub fn of(index: [i32; 3]) -> (VoxelKey, Self) {
        let spread = |i: i32| (Self::SPREAD >> ((i & 7) * 8)) as u16 & 0xff;
        let cell = spread(index[0]) | spread(index[1]) << 1 | spread(index[2]) << 2;
        (VoxelKey::pack(index.map(|i| i >> BLOCK_LEVELS)), Self(cell))
    }

    /// The cell of a voxel in its block.
    #[inline(always)]
    pub(crate) fn of_key(voxel: VoxelKey) -> Self {
        Self::of(voxel.index()).1
    }

    /// The key of this cell's voxel in `block`: the inverse of [`Cell::of`].
    #[inline(always)]
    pub fn voxel(self, block: VoxelKey) -> VoxelKey {
        block.first_within(BLOCK_LEVELS).offset_by(OFFSETS[usize::from(self.0)])
    }

    /// How many cells of the block lie before this one along each axis.
    #[inline(always)]
    pub(crate) fn index(self) -> [usize; 3] {
        let [x, y, z] = VoxelKey::default().offset_by(OFFSETS[usize::from(self.0)]).index();
        [x as usize, y as usize, z as usize]
    }

    /// Which word of the mask holds this cell.
    #[inline(always)]
    pub(crate) fn word(self) -> usize {
        usize::from(self.0 >> 6)
    }

    /// Which bit of its word it is.
    #[inline(always)]
    pub(crate) fn bit(self) -> u32 {
        u32::from(self.0 & 63)
    }

    /// The cell's number within its block.
    #[inline(always)]
    pub(crate) fn to_bits(self) -> u16 {
        self.0
    }

    /// The cell of the number in the low nine bits of `n`.
    #[inline(always)]
    pub(crate) fn from_bits(n: u16) -> Self {
        Self(n % CELLS as u16)
    }
}

/// Cells of a block.
pub(super) const CELLS: usize = 64 * WORDS;

/// What a cell's number adds to the key of its block's first voxel; of a coarsened block's cells as well.
pub(super) static OFFSETS: [u64; CELLS] = {
    let mut offsets = [0; CELLS];
    let mut cell = 0;
    while cell < CELLS {
        let mut bit = 0;
        while bit < BLOCK_LEVELS * 3 {
            if cell >> bit & 1 == 1 {
                offsets[cell] |= VoxelKey::axis_unit(bit % 3) << (bit / 3);
            }
            bit += 1;
        }
        cell += 1;
    }
    offsets
};

/// The occupied voxels of one block, at three levels: level 0 a bit, level 1 a byte that is not zero, level 2
/// a word that is not zero. That a parent goes with its last child holds by construction.
#[derive(Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BlockMask(pub(crate) [u64; WORDS]);

impl BlockMask {
    /// No voxel.
    pub const EMPTY: Self = Self([0; WORDS]);

    /// Bytes of a mask.
    pub const BYTES: usize = WORDS * 8;

    /// The mask's words, each little-endian.
    pub fn to_le_bytes(self) -> [u8; Self::BYTES] {
        bytemuck::cast(self.0.map(u64::to_le_bytes))
    }

    /// The inverse of [`BlockMask::to_le_bytes`].
    pub fn from_le_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Self(bytemuck::cast::<_, [[u8; 8]; WORDS]>(*bytes).map(u64::from_le_bytes))
    }

    /// Adds a cell; true when it was absent.
    #[inline]
    pub fn insert(&mut self, cell: Cell) -> bool {
        let word = &mut self.0[cell.word()];
        let bit = 1 << cell.bit();
        let absent = *word & bit == 0;
        *word |= bit;
        absent
    }

    /// True when a voxel within the ancestor of `cell`, `level` (0, 1 or 2) levels up, is occupied.
    #[inline(always)]
    pub fn contains(&self, cell: Cell, level: u32) -> bool {
        self.0[cell.word()] & Self::within(cell, level) != 0
    }

    /// How large the empty aligned cube around `cell` is: the levels (0, 1 or 2) from a cell up to it. None where the
    /// ancestor of `cell`, `level` (0, 1 or 2) levels up, is occupied.
    #[inline(always)]
    pub(super) fn empty_levels(&self, cell: Cell, level: u32) -> Option<u32> {
        let word = self.0[cell.word()];
        let is_empty = |level: u32| word & Self::within(cell, level) == 0;
        // What is empty is so at each level below, so that a sum says up to which: no branch to guess.
        is_empty(level).then(|| u32::from(is_empty(1)) + u32::from(is_empty(2)))
    }

    /// The bits of `cell`'s word that share its ancestor `level` levels up.
    #[inline(always)]
    fn within(cell: Cell, level: u32) -> u64 {
        match level {
            0 => 1 << cell.bit(),
            1 => 0xff << (cell.bit() & 0b11_1000),
            _ => u64::MAX,
        }
    }

    /// Fills the whole ancestor of `cell`, `level` levels up.
    pub(crate) fn fill(&mut self, cell: Cell, level: u32) {
        self.0[cell.word()] |= Self::within(cell, level);
    }

    /// True when no voxel is occupied.
    #[inline]
    pub fn is_empty(&self) -> bool {
        // A comparison of arrays would be a call.
        self.0.iter().fold(0, |any, word| any | word) == 0
    }

    /// Number of occupied voxels at `level` (0, 1 or 2).
    pub fn count(&self, level: u32) -> usize {
        self.coarsened(level).0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The occupied voxels at `level` (0, 1 or 2), each as the first cell it covers, ascending.
    #[inline]
    pub fn cells(&self, level: u32) -> impl Iterator<Item = Cell> + use<> {
        let words = self.coarsened(level).0;
        (0..WORDS).flat_map(move |w| {
            let mut rest = words[w];
            std::iter::from_fn(move || {
                let bit = (rest != 0).then(|| rest.trailing_zeros())?;
                rest &= rest - 1;
                Some(Cell(((w as u16) << 6 | bit as u16) << (3 * level)))
            })
        })
    }

    /// The occupied voxels at `level` (0, 1 or 2) that one word of the mask holds, each as the first cell it covers,
    /// ascending.
    #[inline(always)]
    pub(crate) fn cells_of_word(&self, word: usize, level: u32) -> impl Iterator<Item = Cell> + use<> {
        let mut rest = match level {
            0 => self.0[word],
            1 => occupied_bytes(self.0[word]),
            _ => u64::from(self.0[word] != 0),
        };
        std::iter::from_fn(move || {
            let bit = (rest != 0).then(|| rest.trailing_zeros() << (3 * level))?;
            rest &= rest - 1;
            Some(Cell((word as u16) << 6 | bit as u16))
        })
    }

    /// The finest voxels within the ancestor of `cell` two levels up, ascending.
    #[inline]
    pub(crate) fn part(&self, cell: Cell) -> impl Iterator<Item = Cell> + use<> {
        let (first, mut rest) = (cell.0 & !63, self.0[cell.word()]);
        std::iter::from_fn(move || {
            let bit = (rest != 0).then(|| rest.trailing_zeros())?;
            rest &= rest - 1;
            Some(Cell(first | bit as u16))
        })
    }

    /// The occupied voxels at `level` (0, 1 or 2) as the cells of a block of as many fewer levels: the first 512, 64 or
    /// 8.
    #[inline]
    pub(super) fn coarsened(&self, level: u32) -> Self {
        match level {
            0 => *self,
            1 => self.word_by_word(WORDS, occupied_bytes),
            _ => self.word_by_word(1, |word| u64::from(word != 0)),
        }
    }

    /// What `bits` makes of each word, `each` bits of it, in the first word.
    #[inline(always)]
    fn word_by_word(&self, each: usize, bits: impl Fn(u64) -> u64) -> Self {
        let first = (0..WORDS).fold(0, |first, w| first | bits(self.0[w]) << (each * w));
        Self([first, 0, 0, 0, 0, 0, 0, 0])
    }

    /// The moments of the voxels of `block` two levels up that had other descendants `before`: which of their points
    /// lay in what is gone is not known, and so the centers of what remains stand for them.
    pub(crate) fn rebuilt_moments(
        &self,
        before: &Self,
        block: VoxelKey,
    ) -> impl Iterator<Item = (VoxelKey, Moments)> + use<> {
        let words = before.0.into_iter().zip(self.0).enumerate();
        words.filter(|(_, (before, after))| before != after).map(move |(w, (_, after))| {
            let voxel = Cell((w as u16) << 6).voxel(block).ancestor(BLOCK_LEVELS - 1);
            (voxel, Moments::of_descendants(after))
        })
    }

    /// The moments of the centers of `block`'s voxels, voxel by voxel two levels up.
    pub(crate) fn moments(&self, block: VoxelKey) -> impl Iterator<Item = (VoxelKey, Moments)> + use<> {
        self.rebuilt_moments(&Self::EMPTY, block)
    }

    /// This with the voxels of `other` as well.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] | other.0[w]))
    }

    /// The voxels in both.
    #[inline]
    pub fn intersection(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] & other.0[w]))
    }

    /// The voxels in one of the two and not in the other.
    #[inline]
    pub fn symmetric_difference(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] ^ other.0[w]))
    }

    /// The voxels of this that are not in `other`.
    #[inline]
    pub fn difference(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] & !other.0[w]))
    }
}

/// A bit for each byte of `word` that is not zero.
#[inline(always)]
fn occupied_bytes(word: u64) -> u64 {
    let word = word | word >> 4;
    let word = word | word >> 2;
    let low_bits = (word | word >> 1) & 0x0101_0101_0101_0101;
    // The product brings bit 8 i to bit 56 + i, and nothing else there.
    low_bits.wrapping_mul(0x0102_0408_1020_4080) >> 56
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_voxel_is_its_block_and_cell(index: [i16; 3]) {
            let index = index.map(i32::from);
            let (block, cell) = Cell::of(index);
            prop_assert_eq!(cell.voxel(block), VoxelKey::pack(index));
            prop_assert_eq!(Cell::of_key(VoxelKey::pack(index)), cell);
        }

        #[test]
        fn a_mask_holds_three_levels(cells in prop::collection::btree_set(0u16..512, 0..80)) {
            let mut mask = BlockMask::EMPTY;
            for &c in &cells {
                prop_assert!(mask.insert(Cell(c)));
                prop_assert!(!mask.insert(Cell(c)));
            }
            for level in 0..3 {
                let parents: BTreeSet<u16> = cells.iter().map(|c| c >> (3 * level)).collect();
                let found: Vec<u16> = mask.cells(level).map(|c| c.0 >> (3 * level)).collect();
                prop_assert_eq!(&found, &parents.iter().copied().collect::<Vec<_>>());
                prop_assert_eq!(mask.count(level), parents.len());
                for c in 0..512 {
                    prop_assert_eq!(mask.contains(Cell(c), level), parents.contains(&(c >> (3 * level))));
                }
            }
        }
    }
}
