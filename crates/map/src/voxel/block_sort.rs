//! Voxels put together by block.

use super::block::{BLOCK_LEVELS, BlockMask, Cell};
use super::key::{AXIS_BITS, AXIS_MASK, AXIS_UNITS, VoxelKey};

/// Bits of a cell's number.
const CELL_BITS: u32 = 3 * BLOCK_LEVELS;
/// Bits of a code that one pass of the sort looks at, at most: their counts fit in the innermost cache.
const DIGIT_BITS: u32 = 12;

/// The blocks of finest voxels, in any order and repeated or not: ascending by key, each once.
///
/// A scan jumps from block to block, so that a table of blocks would miss the caches once a point. Instead the
/// voxels are sorted by block, one digit after the other (LSD radix sort), as codes of few digits:
///
/// ```text
/// code   | block's z | block's y | block's x | cell (9 bits) |
/// ```
///
/// An axis takes as many bits, in two's complement, as its largest index here needs: codes order as keys do.
pub(super) fn blocks_of(voxels: &[VoxelKey]) -> Vec<(VoxelKey, BlockMask)> {
    let layout = Layout::of(voxels);
    let mut codes: Vec<u64> = voxels.iter().map(|&voxel| layout.encode(voxel)).collect();
    codes.dedup();
    sort_by_digits(&mut codes, CELL_BITS..layout.bits());
    let borders = codes.iter().zip(codes.iter().skip(1)).filter(|(a, b)| (*a ^ *b) >> CELL_BITS != 0).count();
    let mut blocks: Vec<(VoxelKey, BlockMask)> = Vec::with_capacity(borders + 1);
    let mut last = None;
    for code in codes {
        let (block, cell) = (code >> CELL_BITS, Cell::from_bits(code as u16));
        if last != Some(block) {
            last = Some(block);
            blocks.push((layout.decode(block), BlockMask::EMPTY));
        }
        if let Some((_, mask)) = blocks.last_mut() {
            mask.insert(cell);
        }
    }
    blocks
}

/// How many bits of a code the block's index takes, axis by axis.
struct Layout([u32; 3]);

impl Layout {
    fn of(voxels: &[VoxelKey]) -> Self {
        // Bits that differ from their axis' sign bit, in any key: what it takes to tell the indices apart.
        let telling = voxels.iter().fold(0, |telling, voxel| {
            let signs = voxel.to_bits() >> (AXIS_BITS - 1) & AXIS_UNITS;
            telling | (voxel.to_bits() ^ (signs * AXIS_MASK))
        });
        let bits = |axis: u32| {
            let telling = telling >> (axis * AXIS_BITS) & AXIS_MASK;
            (u64::BITS - (telling >> BLOCK_LEVELS).leading_zeros()) + 1
        };
        Self([0, 1, 2].map(bits))
    }

    fn bits(&self) -> u32 {
        CELL_BITS + self.0.iter().sum::<u32>()
    }

    #[inline(always)]
    fn encode(&self, voxel: VoxelKey) -> u64 {
        let (mut code, mut shift) = (u64::from(Cell::of_key(voxel).to_bits()), CELL_BITS);
        for (axis, bits) in (0..).zip(self.0) {
            let block = voxel.to_bits() >> (axis * AXIS_BITS + BLOCK_LEVELS);
            code |= (block & ((1 << bits) - 1)) << shift;
            shift += bits;
        }
        code
    }

    /// The block of a code without its cell.
    fn decode(&self, mut block: u64) -> VoxelKey {
        VoxelKey::pack(self.0.map(|bits| {
            let unused = u64::BITS - bits;
            let index = (block << unused) as i64 >> unused;
            block >>= bits;
            index as i32
        }))
    }
}

/// Sorts by the bits of `range`, in place, in as few passes as may be, with digits alike.
fn sort_by_digits(codes: &mut Vec<u64>, range: std::ops::Range<u32>) {
    let bits = range.end - range.start;
    let width = bits.div_ceil(bits.div_ceil(DIGIT_BITS));
    let mut sorted = vec![0; codes.len()];
    let mut places = vec![0u32; 1 << width];
    for shift in range.clone().step_by(width as usize) {
        let digit = |code: u64| ((code & ((1 << range.end) - 1)) >> shift) as usize & ((1 << width) - 1);
        places.fill(0);
        codes.iter().for_each(|&code| places[digit(code)] += 1);
        let mut before = 0;
        for place in &mut places {
            before += std::mem::replace(place, before);
        }
        for &code in codes.iter() {
            let place = &mut places[digit(code)];
            sorted[*place as usize] = code;
            *place += 1;
        }
        std::mem::swap(codes, &mut sorted);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::key::{INDEX_MAX, INDEX_MIN};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn blocks_are_grouped_as_an_ordered_map_does_it(
            voxels in prop::collection::vec(prop::array::uniform3(prop_oneof![
                10 => -40i32..40,
                1 => prop::sample::select(vec![INDEX_MIN, -4097, 900, INDEX_MAX]),
            ]), 0..300),
        ) {
            let mut expected = BTreeMap::<VoxelKey, BlockMask>::new();
            for &index in &voxels {
                let (block, cell) = Cell::of(index);
                expected.entry(block).or_default().insert(cell);
            }
            let keys: Vec<_> = voxels.into_iter().map(VoxelKey::pack).collect();
            prop_assert_eq!(blocks_of(&keys), expected.into_iter().collect::<Vec<_>>());
        }
    }
}
