//! The nearest voxel of one block.

use super::seeker::Seeker;
use crate::voxel::{BLOCK_SIDE, BlockMask, VoxelKey};

/// Cells along a block's side.
const CELLS: usize = BLOCK_SIDE as usize;

/// Squared distances of a point to a block's voxels, axis by axis: for each cell along the axis, that to the voxel of
/// the level which holds it.
struct Gaps([[f64; CELLS]; 3]);

impl Gaps {
    #[inline(always)]
    fn of(seeker: &Seeker, first: [i32; 3]) -> Self {
        let cells: [[f64; CELLS]; 3] = match seeker.up {
            0 => seeker.squared_gaps(first, 1),
            1 => repeated(seeker.squared_gaps::<4>(first, 2)),
            _ => repeated(seeker.squared_gaps::<2>(first, 4)),
        };
        Self(cells)
    }

    #[inline(always)]
    fn squared(&self, [x, y, z]: [usize; 3]) -> f64 {
        self.0[0][x] + self.0[1][y] + self.0[2][z]
    }

    /// Along each axis the smallest of the first and of the second half.
    #[inline(always)]
    fn of_halves(&self) -> [[f64; 2]; 3] {
        let smallest = |cells: &[f64]| cells.iter().copied().fold(f64::INFINITY, f64::min);
        self.0.map(|cells| [smallest(&cells[..CELLS / 2]), smallest(&cells[CELLS / 2..])])
    }
}

/// The distances to some voxels as those of the cells that make them up.
#[inline(always)]
fn repeated<const N: usize>(voxels: [[f64; N]; 3]) -> [[f64; CELLS]; 3] {
    voxels.map(|voxels| std::array::from_fn(|cell| voxels[cell * N / CELLS]))
}

/// Looks for something nearer in the block whose first cell is `first`: word by word, that of the point's octant first.
pub(super) fn nearest_in_block(seeker: &mut Seeker, mask: &BlockMask, first: [i32; 3]) {
    let gaps = Gaps::of(seeker, first);
    let halves = gaps.of_halves();
    let half = |axis: usize| usize::from(halves[axis][1] < halves[axis][0]);
    let octant = half(0) | half(1) << 1 | half(2) << 2;
    for step in 0..8 {
        let word = step ^ octant;
        let squared = halves[0][word & 1] + halves[1][word >> 1 & 1] + halves[2][word >> 2];
        if mask.0[word] != 0 && seeker.may_be_nearest(squared) {
            nearest_in_word(seeker, mask, word, &gaps, first);
        }
    }
}

#[inline(always)]
fn nearest_in_word(seeker: &mut Seeker, mask: &BlockMask, word: usize, gaps: &Gaps, first: [i32; 3]) {
    for cell in mask.cells_of_word(word, seeker.up) {
        let squared = gaps.squared(cell.index());
        if seeker.may_be_nearest(squared) {
            let index = cell.index();
            let voxel = std::array::from_fn(|axis| (first[axis] + index[axis] as i32) >> seeker.up);
            seeker.offer(squared, VoxelKey::pack(voxel));
        }
    }
}
