//! AVX2 variant of the offsets: eight points at a time.
#![expect(
    unsafe_code,
    reason = "vector intrinsics, and functions that are compiled for more than the crate is"
)]

use std::arch::x86_64::*;

use crate::rivals::dense::grid::Grid;
use mrol_map::geometry::Point;
use mrol_map::util::cpu::Avx2;
use mrol_map::voxel::LatticeFromPoints;
use mrol_map::voxel::quantize::avx2::{LANES, Quantizer};

/// Points that take each step together.
const BATCH: usize = 128;

/// AVX2 variant of [`super::offsets`].
pub(super) fn offsets(
    _: Avx2,
    points: &[Point],
    t: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    // SAFETY: the token says that the CPU has the features.
    unsafe { all_offsets(points, t, level, grid, offsets) }
}

#[target_feature(enable = "avx2")]
fn all_offsets(points: &[Point], t: &LatticeFromPoints, level: u32, grid: &Grid, offsets: &mut [u32]) {
    let (quantizer, mut index, mut has_voxel) = (Quantizer::load(t, level), [[0; BATCH]; 3], [false; BATCH]);
    for (points, offsets) in points.chunks(BATCH).zip(offsets.chunks_mut(BATCH)) {
        for (group, points) in points.chunks(LANES).enumerate() {
            let (eight, valid) = quantizer.index(points);
            for (axis, eight) in index.iter_mut().zip(eight) {
                let to: &mut [i32] = &mut axis[group * LANES..][..LANES];
                // SAFETY: eight i32 are one register.
                unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), eight) };
            }
            for (lane, has_voxel) in has_voxel[group * LANES..][..LANES].iter_mut().enumerate() {
                *has_voxel = valid >> lane & 1 == 1;
            }
        }
        let [x, y, z] = &index;
        for (i, offset) in offsets.iter_mut().enumerate() {
            // Free of branches, so that it compiles to vector instructions.
            let inside = grid.offset([x[i], y[i], z[i]]);
            *offset = if has_voxel[i] { inside } else { grid.cells() as u32 };
        }
    }
}
