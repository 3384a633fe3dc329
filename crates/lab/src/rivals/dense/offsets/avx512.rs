//! AVX-512 variant of the offsets: sixteen points at a time.
#![expect(
    unsafe_code,
    reason = "vector intrinsics, and functions that are compiled for more than the crate is"
)]

use std::arch::x86_64::*;

use crate::rivals::dense::grid::Grid;
use mrol_map::geometry::Point;
use mrol_map::util::cpu::Avx512;
use mrol_map::voxel::LatticeFromPoints;
use mrol_map::voxel::quantize::avx512::{LANES, Quantizer};

/// AVX-512 variant of [`super::offsets`].
pub(super) fn offsets(
    _: Avx512,
    points: &[Point],
    t: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    // SAFETY: the token says that the CPU has the features.
    unsafe { all_offsets(points, t, level, grid, offsets) }
}

#[target_feature(enable = "avx512f,avx512dq")]
fn all_offsets(points: &[Point], t: &LatticeFromPoints, level: u32, grid: &Grid, offsets: &mut [u32]) {
    let quantizer = Quantizer::load(t, level);
    let (min, size) =
        (grid.min.map(|m| _mm512_set1_epi32(m)), grid.size.map(|s| _mm512_set1_epi32(s as i32)));
    let outside = _mm512_set1_epi32(grid.cells() as u32 as i32);
    for (points, offsets) in points.chunks(LANES).zip(offsets.chunks_mut(LANES)) {
        let (index, mut inside) = quantizer.index(points);
        let cell: [__m512i; 3] = [0, 1, 2].map(|k| _mm512_sub_epi32(index[k], min[k]));
        for (cell, size) in cell.iter().zip(size) {
            inside &= _mm512_cmplt_epu32_mask(*cell, size);
        }
        let [x, y, z] = cell;
        let row = _mm512_add_epi32(_mm512_mullo_epi32(z, size[1]), y);
        let offset = _mm512_add_epi32(_mm512_mullo_epi32(row, size[0]), x);
        let offset = _mm512_mask_mov_epi32(outside, inside, offset);
        let present = ((1u32 << offsets.len()) - 1) as u16;
        // SAFETY: the store is masked to the offsets that are.
        unsafe { _mm512_mask_storeu_epi32(offsets.as_mut_ptr().cast(), present, offset) };
    }
}
