//! From points to voxel indices and shards: the twin of `LatticeFromPoints::index` and `shard_of_region`.

use std::arch::x86_64::*;

use super::LANES;
use super::registers::lanes;
use crate::geometry::Point;
use crate::map::lookup::LevelView;
use crate::map::sharding::SHARDS;
use crate::voxel::LatticeFromPoints;

/// From points to indices of a level and shards.
pub(super) struct Place {
    quantise: Quantise,
    level: __m128i,
    region_shift: __m128i,
}

impl Place {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(lattice_from_points: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        Self {
            quantise: Quantise::load(lattice_from_points),
            level: _mm_cvtsi32_si128(view.level as i32),
            region_shift: _mm_cvtsi32_si128(view.region_shift as i32),
        }
    }

    /// Indices, shards, and a bit for each of up to sixteen points that has them.
    ///
    /// # Safety
    /// Needs AVX-512 F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn of(&self, points: &[Point]) -> ([__m512i; 3], __m512i, u16) {
        // SAFETY: the feature is there.
        let [a, b, c] = unsafe { load(points) };
        let (index, valid) = self.quantise.index(deinterleave(a, b, c));
        let index = index.map(|i| _mm512_sra_epi32(i, self.level));
        (index, shard(index.map(|i| _mm512_sra_epi32(i, self.region_shift))), valid)
    }
}

/// The 48 coordinates of up to sixteen points, zeros after the last.
///
/// # Safety
/// Needs AVX-512 F.
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn load(points: &[Point]) -> [__m512; 3] {
    let mut tail = [Point::new(0.0, 0.0, 0.0); LANES];
    let start = if points.len() == LANES {
        points.as_ptr()
    } else {
        tail[..points.len()].copy_from_slice(points);
        tail.as_ptr()
    };
    // SAFETY: sixteen points are 48 f32, at any alignment.
    unsafe { std::array::from_fn(|i| _mm512_loadu_ps(start.cast::<f32>().add(i * LANES))) }
}

/// For coordinate `axis`: which of the 32 values of the first two registers goes to each lane, and then which
/// of those and the third register.
const fn deinterleave_index(axis: usize) -> [[i32; LANES]; 2] {
    let mut index = [[0; LANES]; 2];
    let mut lane = 0;
    while lane < LANES {
        let from = 3 * lane + axis;
        if from < 32 {
            index[0][lane] = from as i32;
            index[1][lane] = lane as i32;
        } else {
            index[1][lane] = (from - 32 + LANES) as i32;
        }
        lane += 1;
    }
    index
}

const DEINTERLEAVE: [[[i32; LANES]; 2]; 3] =
    [deinterleave_index(0), deinterleave_index(1), deinterleave_index(2)];

/// x y z x y z ... in three registers to x, y and z in one each.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn deinterleave(a: __m512, b: __m512, c: __m512) -> [__m512; 3] {
    DEINTERLEAVE.map(|[first, second]| {
        let ab = _mm512_permutex2var_ps(a, lanes(&first), b);
        _mm512_permutex2var_ps(ab, lanes(&second), c)
    })
}

/// The twin of [`LatticeFromPoints::index`].
pub(super) struct Quantise {
    rotation: [[__m512; 3]; 3],
    translation: [__m512; 3],
    per_resolution: __m512,
}

impl Quantise {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(t: &LatticeFromPoints) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm512_set1_ps(r))),
            translation: t.translation.map(|c| _mm512_set1_ps(c)),
            per_resolution: _mm512_set1_ps(t.per_resolution),
        }
    }

    /// Indices of level 0, and a bit for each point that has them.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn index(&self, [x, y, z]: [__m512; 3]) -> ([__m512i; 3], u16) {
        let min = _mm512_set1_ps(LatticeFromPoints::QUANTISED_MIN);
        let end = _mm512_set1_ps(LatticeFromPoints::QUANTISED_END);
        let mut valid = u16::MAX;
        let mut index = [_mm512_setzero_si512(); 3];
        for (axis, index) in index.iter_mut().enumerate() {
            let [r0, r1, r2] = self.rotation[axis];
            let sum = _mm512_add_ps(_mm512_mul_ps(r0, x), _mm512_mul_ps(r1, y));
            let sum = _mm512_add_ps(sum, _mm512_mul_ps(r2, z));
            let scaled = _mm512_mul_ps(_mm512_add_ps(sum, self.translation[axis]), self.per_resolution);
            let q = _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(scaled);
            valid &= _mm512_cmp_ps_mask::<_CMP_GE_OQ>(q, min) & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(q, end);
            *index = _mm512_cvttps_epi32(q);
        }
        (index, valid)
    }
}

/// The twin of `sharding::shard_of_region`.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn shard([x, y, z]: [__m512i; 3]) -> __m512i {
    let colour = _mm512_slli_epi32::<2>(_mm512_add_epi32(y, z));
    let colour = _mm512_add_epi32(colour, _mm512_add_epi32(x, z));
    _mm512_and_si512(colour, _mm512_set1_epi32(SHARDS as i32 - 1))
}
