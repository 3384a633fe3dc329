//! Quantization of eight points at a time, for CPUs with AVX2.
#![expect(
    unsafe_code,
    reason = "vector intrinsics, and functions that are compiled for more than the crate is"
)]

use std::arch::x86_64::*;

use super::scalar::NO_KEY;
use crate::geometry::Point;
use crate::util::cpu::Avx2;
use crate::voxel::lattice::LatticeFromPoints;

/// Points of one f32 register.
pub const LANES: usize = 8;

/// See [`super::keys`].
pub(super) fn keys(_: Avx2, points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    // SAFETY: the token says that the CPU has the features.
    unsafe { all_keys(points, t, level, keys) }
}

#[target_feature(enable = "avx2")]
fn all_keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    let (quantizer, mut packed) = (Quantizer::load(t, level), [0; LANES]);
    for (points, keys) in points.chunks(LANES).zip(keys.chunks_mut(LANES)) {
        let (index, valid) = quantizer.index(points);
        for (packed, four) in packed.as_chunks_mut::<4>().0.iter_mut().zip(pack(index)) {
            // SAFETY: four u64 are one register.
            unsafe { _mm256_storeu_si256(packed.as_mut_ptr().cast(), four) };
        }
        for (lane, (key, packed)) in keys.iter_mut().zip(packed).enumerate() {
            *key = if valid >> lane & 1 == 1 { packed } else { NO_KEY };
        }
    }
}

/// Eight packed keys (`VoxelKey::pack`), four a register.
#[inline]
#[target_feature(enable = "avx2")]
fn pack(index: [__m256i; 3]) -> [__m256i; 2] {
    let [low, high] =
        [index.map(|i| _mm256_castsi256_si128(i)), index.map(|i| _mm256_extracti128_si256::<1>(i))];
    [pack_four(low), pack_four(high)]
}

/// Four packed keys (`VoxelKey::pack`).
#[inline]
#[target_feature(enable = "avx2")]
pub(crate) fn pack_four(index: [__m128i; 3]) -> __m256i {
    let field = _mm256_set1_epi64x(0x1f_ffff);
    let [x, y, z] = index.map(|i| _mm256_and_si256(_mm256_cvtepu32_epi64(i), field));
    _mm256_or_si256(x, _mm256_or_si256(_mm256_slli_epi64::<21>(y), _mm256_slli_epi64::<42>(z)))
}

/// The transform and the level, spread over lanes.
pub struct Quantizer {
    rotation: [[__m256; 3]; 3],
    translation: [__m256; 3],
    level: __m128i,
}

impl Quantizer {
    /// The transform and the level, in every lane.
    ///
    /// # Safety
    /// Needs AVX2.
    #[target_feature(enable = "avx2")]
    pub fn load(t: &LatticeFromPoints, level: u32) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm256_set1_ps(r))),
            translation: t.translation.map(|c| _mm256_set1_ps(c)),
            level: _mm_cvtsi32_si128(level as i32),
        }
    }

    /// Indices of the level of up to eight points, axis by axis, and a bit for each that has a voxel: the SIMD variant
    /// of [`LatticeFromPoints::index`].
    ///
    /// # Safety
    /// Needs AVX2.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub fn index(&self, points: &[Point]) -> ([__m256i; 3], u8) {
        let [x, y, z] = deinterleave(load(points));
        let min = _mm256_set1_ps(LatticeFromPoints::QUANTIZED_MIN);
        let end = _mm256_set1_ps(LatticeFromPoints::QUANTIZED_END);
        let mut valid = u8::MAX;
        let mut indices = [_mm256_setzero_si256(); 3];
        for (axis, index) in indices.iter_mut().enumerate() {
            let [r0, r1, r2] = self.rotation[axis];
            let sum = _mm256_add_ps(_mm256_mul_ps(r0, x), _mm256_mul_ps(r1, y));
            let sum = _mm256_add_ps(sum, _mm256_mul_ps(r2, z));
            let q = _mm256_floor_ps(_mm256_add_ps(sum, self.translation[axis]));
            let in_range =
                _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(q, min), _mm256_cmp_ps::<_CMP_LT_OQ>(q, end));
            valid &= _mm256_movemask_ps(in_range) as u8;
            *index = _mm256_sra_epi32(_mm256_cvttps_epi32(q), self.level);
        }
        (indices, valid)
    }
}

/// The 24 coordinates of up to eight points, zeros after the last.
#[inline]
#[target_feature(enable = "avx2")]
fn load(points: &[Point]) -> [__m256; 3] {
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
