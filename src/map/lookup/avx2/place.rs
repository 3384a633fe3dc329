//! From points to voxel indices and shards: the twin of `LatticeFromPoints::index` and `shard_of_region`.

use std::arch::x86_64::*;

use super::{Batch, LANES};
use crate::geometry::Point;
use crate::map::lookup::LevelView;
use crate::map::sharding::SHARDS;
use crate::voxel::LatticeFromPoints;

/// The transform and the level, spread over lanes.
pub(super) struct Quantizer {
    rotation: [[__m256; 3]; 3],
    translation: [__m256; 3],
    level: __m128i,
    region_shift: __m128i,
}

impl Quantizer {
    #[target_feature(enable = "avx2")]
    pub(super) fn load(t: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        Self::of_level(t, view.level, view.region_shift)
    }

    /// The same without a view.
    #[target_feature(enable = "avx2")]
    pub(super) fn of_level(t: &LatticeFromPoints, level: u32, region_shift: u32) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm256_set1_ps(r))),
            translation: t.translation.map(|c| _mm256_set1_ps(c)),
            level: _mm_cvtsi32_si128(level as i32),
            region_shift: _mm_cvtsi32_si128(region_shift as i32),
        }
    }

    /// Writes where up to eight points fall to the batch, from `at` on; a bit for each that has a voxel.
    ///
    /// # Safety
    /// Needs AVX2.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn of(&self, points: &[Point], at: usize, batch: &mut Batch) -> u8 {
        // SAFETY: the feature is there.
        let [x, y, z] = unsafe { deinterleave(load(points)) };
        let min = _mm256_set1_ps(LatticeFromPoints::QUANTIZED_MIN);
        let end = _mm256_set1_ps(LatticeFromPoints::QUANTIZED_END);
        let mut valid = u8::MAX;
        let mut regions = [_mm256_setzero_si256(); 3];
        for (axis, region) in regions.iter_mut().enumerate() {
            let [r0, r1, r2] = self.rotation[axis];
            let sum = _mm256_add_ps(_mm256_mul_ps(r0, x), _mm256_mul_ps(r1, y));
            let sum = _mm256_add_ps(sum, _mm256_mul_ps(r2, z));
            let q = _mm256_floor_ps(_mm256_add_ps(sum, self.translation[axis]));
            let in_range =
                _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(q, min), _mm256_cmp_ps::<_CMP_LT_OQ>(q, end));
            valid &= _mm256_movemask_ps(in_range) as u8;
            let index = _mm256_sra_epi32(_mm256_cvttps_epi32(q), self.level);
            *region = _mm256_sra_epi32(index, self.region_shift);
            write(&mut batch.index[axis][at..], index);
        }
        write(&mut batch.shard[at..], shard(regions));
        valid
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn write(to: &mut [i32], lanes: __m256i) {
    // SAFETY: eight i32 are one register, and the slice has room for them (it is indexed to say so).
    unsafe { _mm256_storeu_si256(to[..LANES].as_mut_ptr().cast(), lanes) };
}

#[inline]
#[target_feature(enable = "avx2")]
fn shard([x, y, z]: [__m256i; 3]) -> __m256i {
    let color = _mm256_slli_epi32::<2>(_mm256_add_epi32(y, z));
    let color = _mm256_add_epi32(color, _mm256_add_epi32(x, z));
    _mm256_and_si256(color, _mm256_set1_epi32(SHARDS as i32 - 1))
}

/// The 24 coordinates of up to eight points, zeros after the last.
///
/// # Safety
/// Needs AVX2.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn load(points: &[Point]) -> [__m256; 3] {
    let mut tail = [Point::new(0.0, 0.0, 0.0); LANES];
    let start = if points.len() == LANES {
        points.as_ptr()
    } else {
        tail[..points.len()].copy_from_slice(points);
        tail.as_ptr()
    };
    // SAFETY: eight points are 24 f32, at any alignment.
    unsafe { [0, 1, 2].map(|i| _mm256_loadu_ps(start.cast::<f32>().add(i * LANES))) }
}

/// x y z x y z ... in three registers to x, y and z in one each.
///
/// ```text
/// a = x0 y0 z0 x1 y1 z1 x2 y2    b = z2 x3 y3 z3 x4 y4 z4 x5    c = y5 z5 x6 y6 z6 x7 y7 z7
/// ```
#[inline]
#[target_feature(enable = "avx2")]
fn deinterleave([a, b, c]: [__m256; 3]) -> [__m256; 3] {
    let x = _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5);
    let y = _mm256_setr_epi32(1, 4, 7, 2, 5, 0, 3, 6);
    let z = _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7);
    let pick = |order| [a, b, c].map(|from| _mm256_permutevar8x32_ps(from, order));
    let ([xa, xb, xc], [ya, yb, yc], [za, zb, zc]) = (pick(x), pick(y), pick(z));
    [
        _mm256_blend_ps::<0b1100_0000>(_mm256_blend_ps::<0b0011_1000>(xa, xb), xc),
        _mm256_blend_ps::<0b1110_0000>(_mm256_blend_ps::<0b0001_1000>(ya, yb), yc),
        _mm256_blend_ps::<0b1110_0000>(_mm256_blend_ps::<0b0001_1100>(za, zb), zc),
    ]
}
