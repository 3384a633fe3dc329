//! One block of the field, computed from the 27 blocks of voxels around it.

use crate::voxel::BlockMask;

/// Bytes of a block: one a cell, x fastest.
pub(super) const BLOCK_BYTES: usize = 512;
/// Bytes of 4 x 4 x 4 cells, see [`cell_place`]; x fastest.
pub(super) const LINE_BYTES: usize = 64;
/// Four times the squared distance where it is that or more.
pub(super) const FAR: u8 = u8::MAX;
/// Cells along the three blocks that a row goes through.
const WINDOW: usize = 24;
/// Steps between a cell and the cubes that are looked at: eight either way.
const STEPS: usize = 17;

/// Four times the squared distance, along one axis, from the middle of a cell to the cube `steps` cells away.
const fn squared_steps(steps: usize) -> u8 {
    let half_cells = if steps == 0 { 0 } else { 2 * steps - 1 };
    let squared = half_cells * half_cells;
    if squared > FAR as usize { FAR } else { squared as u8 }
}

/// [`squared_steps`] from eight steps down to eight steps up.
const SQUARED: [u8; STEPS] = {
    let mut squared = [0; STEPS];
    let mut step = 0;
    while step < STEPS {
        squared[step] = squared_steps(step.abs_diff(8));
        step += 1;
    }
    squared
};

/// The bytes of a block's row of eight cells, by which of four neighboring voxels of a row are occupied: for each of
/// the six places of four voxels in the window.
static OF_FOUR: [[[u8; 8]; 16]; WINDOW / 4] = {
    let mut bytes = [[[FAR; 8]; 16]; WINDOW / 4];
    let mut n = 0;
    while n < WINDOW / 4 * 16 * 8 * 4 {
        let (bit, x, four, place) = (n % 4, n / 4 % 8, n / 32 % 16, n / 512);
        let squared = squared_steps((place * 4 + bit).abs_diff(x + 8));
        if four >> bit & 1 == 1 && squared < bytes[place][four][x] {
            bytes[place][four][x] = squared;
        }
        n += 1;
    }
    bytes
};

/// The place of a cell in its block, by the lowest three bits of its indices.
///
/// ```text
/// bit 8 7 6 | 5 4 | 3 2 | 1 0
///     z y x |  z  |  y  |  x
/// ```
///
/// So 4 x 4 x 4 cells are a line of the cache, and what is near each other shares lines.
#[inline(always)]
pub(super) fn cell_place([x, y, z]: [i32; 3]) -> u32 {
    let low = (x & 3) | (y & 3) << 2 | (z & 3) << 4;
    let high = (x & 4) << 4 | (y & 4) << 5 | (z & 4) << 6;
    (low | high) as u32
}

/// Cells in rows along x, in the order of their places.
fn in_lines(rows: &[u8; BLOCK_BYTES]) -> [u8; BLOCK_BYTES] {
    let mut lines = [0; BLOCK_BYTES];
    for (row, cells) in rows.as_chunks::<8>().0.iter().enumerate() {
        let place = cell_place([0, (row & 7) as i32, (row >> 3) as i32]) as usize;
        lines[place..place + 4].copy_from_slice(&cells[..4]);
        lines[place + 64..place + 68].copy_from_slice(&cells[4..]);
    }
    lines
}

/// A byte a cell, see the module's text, at its [`cell_place`].
#[derive(Debug, Clone, PartialEq, Eq)]
#[repr(align(64))]
pub(in crate::planning) struct FieldBlock(pub(super) [u8; BLOCK_BYTES]);

impl FieldBlock {
    /// A block with nothing near.
    pub(super) const FAR: Self = Self([FAR; BLOCK_BYTES]);

    /// The block in the middle of 3 x 3 x 3 blocks of voxels, x fastest; none where nothing is near any of its cells.
    ///
    /// One axis after the other: the smallest sum of what the axes before came to and the squared steps along this one.
    pub(super) fn of(around: &[BlockMask; 27]) -> Option<Self> {
        let mut rows = [FAR; WINDOW * WINDOW * 8];
        let mut is_used = [false; WINDOW];
        for (number, mask) in around.iter().enumerate() {
            along_x(number, mask, &mut rows, &mut is_used);
        }
        let mut slabs = [[FAR; 64]; WINDOW];
        for z in (0..WINDOW).filter(|&z| is_used[z]) {
            let rows = &rows[z * WINDOW * 8..(z + 1) * WINDOW * 8];
            for (step, squared) in SQUARED.iter().enumerate() {
                lower(&mut slabs[z], &rows[step * 8..step * 8 + 64], *squared);
            }
        }
        let mut block = [FAR; BLOCK_BYTES];
        for (z, cells) in block.chunks_exact_mut(64).enumerate() {
            for (step, squared) in SQUARED.iter().enumerate().filter(|(step, _)| is_used[z + step]) {
                lower(cells, &slabs[z + step], *squared);
            }
        }
        block.iter().any(|&byte| byte != FAR).then(|| Self(in_lines(&block)))
    }
}

impl FieldBlock {
    /// The cells that are obstacles: those at no distance.
    pub(super) fn obstacles(&self) -> BlockMask {
        let word = |line: &[u8]| {
            let zeros = (0..).zip(line).fold(0, |word, (place, byte)| word | u64::from(*byte == 0) << place);
            in_morton_order(zeros)
        };
        BlockMask(std::array::from_fn(|line| word(&self.0[line * LINE_BYTES..(line + 1) * LINE_BYTES])))
    }
}

/// The inverse of [`row_by_row`].
fn in_morton_order(word: u64) -> u64 {
    let word = exchange(word, 0x0000_ff00_0000_ff00, 8);
    let word = exchange(word, 0x00f0_00f0_00f0_00f0, 4);
    exchange(word, 0x00cc_00cc_00cc_00cc, 6)
}

/// Lowers each cell to `from` and the steps between, where that is less.
#[inline(always)]
fn lower(cells: &mut [u8], from: &[u8], squared: u8) {
    for (cell, from) in cells.iter_mut().zip(from) {
        *cell = (*cell).min(from.saturating_add(squared));
    }
}

/// Takes the voxels of the block `number` of the 27 into the rows of the window, and marks the slabs that have some.
fn along_x(number: usize, mask: &BlockMask, rows: &mut [u8], is_used: &mut [bool; WINDOW]) {
    for (w, word) in mask.0.into_iter().enumerate().filter(|(_, word)| *word != 0) {
        let fours = [number % 3 * 2 + (w & 1), number / 3 % 3 * 2 + (w >> 1 & 1), number / 9 * 2 + (w >> 2)];
        let of_four = &OF_FOUR[fours[0]];
        let linear = row_by_row(word);
        for row in 0..16 {
            let voxels = (linear >> (4 * row) & 15) as usize;
            if voxels != 0 {
                let (y, z) = (fours[1] * 4 + row % 4, fours[2] * 4 + row / 4);
                is_used[z] = true;
                let cells = (z * WINDOW + y) * 8;
                lower(&mut rows[cells..cells + 8], &of_four[voxels], 0);
            }
        }
    }
}

/// A word of 4 x 4 x 4 voxels in Morton order, as rows of four: x in the lowest two bits of a voxel's number, then y.
fn row_by_row(word: u64) -> u64 {
    // The bits of a voxel's number change places, two at a time: z1 y1 x1 z0 y0 x0 becomes z1 z0 y1 y0 x1 x0.
    let word = exchange(word, 0x00cc_00cc_00cc_00cc, 6);
    let word = exchange(word, 0x00f0_00f0_00f0_00f0, 4);
    exchange(word, 0x0000_ff00_0000_ff00, 8)
}

/// Exchanges the bits of `mask` with those `shift` higher.
#[inline(always)]
fn exchange(word: u64, mask: u64, shift: u32) -> u64 {
    let differ = (word >> shift ^ word) & mask;
    word ^ differ ^ differ << shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::Cell;
    use proptest::prelude::*;

    /// Four times the squared distance from the middle of a cell to a voxel's cube.
    fn squared(cell: [i32; 3], voxel: [i32; 3]) -> u32 {
        let half_cells = |axis: usize| (2 * cell[axis].abs_diff(voxel[axis])).saturating_sub(1);
        (0..3).map(|axis| half_cells(axis).pow(2)).sum()
    }

    proptest! {
        #[test]
        fn every_cell_knows_its_distance(voxels in prop::collection::vec(prop::array::uniform3(-8i32..16), 0..12)) {
            let mut around = [BlockMask::EMPTY; 27];
            for &voxel in &voxels {
                let [x, y, z] = voxel.map(|i| (i >> 3) + 1);
                around[(x + 3 * y + 9 * z) as usize].insert(Cell::of(voxel).1);
            }
            let field = FieldBlock::of(&around).unwrap_or(FieldBlock::FAR);
            for n in 0..512 {
                let cell = [n & 7, n >> 3 & 7, n >> 6];
                let nearest = voxels.iter().map(|&voxel| squared(cell, voxel)).min().unwrap_or(u32::MAX);
                prop_assert_eq!(u32::from(field.0[cell_place(cell) as usize]), nearest.min(u32::from(FAR)), "{:?}", cell);
            }
            prop_assert_eq!(field.obstacles(), around[13]);
        }
    }

    #[test]
    fn a_block_with_nothing_near_is_none() {
        assert_eq!(FieldBlock::of(&[BlockMask::EMPTY; 27]), None);
        let mut around = [BlockMask::EMPTY; 27];
        around[0].insert(Cell::of([0, 0, 0]).1);
        assert_eq!(FieldBlock::of(&around), None);
    }
}
