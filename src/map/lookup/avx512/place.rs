//! From points to voxel indices and shards: the twin of `LatticeFromPoints::index` and `shard_of_region`.

use std::arch::x86_64::*;

use super::LANES;
use super::registers::lanes;
use crate::geometry::Point;
use crate::map::lookup::LevelView;
use crate::map::sharding::SHARDS;
use crate::voxel::{INDEX_MAX, INDEX_MIN, LatticeFromPoints};

/// From points to indices of a level and shards.
pub(super) struct Quantizer {
    quantize: Quantize,
    level: u32,
    shards: Shards,
}

impl Quantizer {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(lattice_from_points: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        Self {
            quantize: Quantize::load(lattice_from_points),
            level: view.level,
            shards: Shards::load(view.region_shift),
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
        let coordinates = unsafe { load(points) };
        let (index, valid) = self.quantize.index(deinterleave(coordinates));
        let index = match self.level {
            0 => index,
            level => index.map(|i| _mm512_sra_epi32(i, _mm_cvtsi32_si128(level as i32))),
        };
        (index, self.shards.of(index), valid)
    }
}

/// The 48 coordinates of up to sixteen points, zeros after the last.
///
/// # Safety
/// Needs AVX-512 F.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn load(points: &[Point]) -> [__m512; 3] {
    if points.len() < LANES {
        // SAFETY: the feature is there.
        return unsafe { load_tail(points) };
    }
    // SAFETY: sixteen points are 48 f32, at any alignment.
    unsafe { [0, 1, 2].map(|i| _mm512_loadu_ps(points.as_ptr().cast::<f32>().add(i * LANES))) }
}

/// # Safety
/// Needs AVX-512 F.
#[cold]
#[target_feature(enable = "avx512f")]
unsafe fn load_tail(points: &[Point]) -> [__m512; 3] {
    let mut sixteen = [Point::new(0.0, 0.0, 0.0); LANES];
    sixteen[..points.len()].copy_from_slice(points);
    // SAFETY: the feature is there.
    unsafe { load(&sixteen) }
}

/// The lanes of register `register`, of three with x y z x y z ..., that hold coordinate `axis`.
const fn lanes_of(axis: usize, register: usize) -> u16 {
    let (mut mask, mut lane) = (0, 0);
    while lane < LANES {
        if (register * LANES + lane) % 3 == axis {
            mask |= 1 << lane;
        }
        lane += 1;
    }
    mask
}

/// Where the coordinate `axis` of each point is, once those of the three registers, no two of which share a lane,
/// are put into one.
const fn order_of(axis: usize) -> [i32; LANES] {
    let (mut order, mut point) = ([0; LANES], 0);
    while point < LANES {
        order[point] = ((3 * point + axis) % LANES) as i32;
        point += 1;
    }
    order
}

/// x y z x y z ... in three registers to x, y and z in one each.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn deinterleave([a, b, c]: [__m512; 3]) -> [__m512; 3] {
    const ORDER: [[i32; LANES]; 3] = [order_of(0), order_of(1), order_of(2)];
    const OF_B: [u16; 3] = [lanes_of(0, 1), lanes_of(1, 1), lanes_of(2, 1)];
    const OF_C: [u16; 3] = [lanes_of(0, 2), lanes_of(1, 2), lanes_of(2, 2)];
    [0, 1, 2].map(|axis| {
        let mixed = _mm512_mask_blend_ps(OF_C[axis], _mm512_mask_blend_ps(OF_B[axis], a, b), c);
        _mm512_permutexvar_ps(lanes(&ORDER[axis]), mixed)
    })
}

/// The twin of [`LatticeFromPoints::index`].
pub(super) struct Quantize {
    rotation: [[__m512; 3]; 3],
    translation: [__m512; 3],
}

impl Quantize {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(t: &LatticeFromPoints) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm512_set1_ps(r))),
            translation: t.translation.map(|c| _mm512_set1_ps(c)),
        }
    }

    /// Indices of level 0, and a bit for each point that has them.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn index(&self, [x, y, z]: [__m512; 3]) -> ([__m512i; 3], u16) {
        let index = [0, 1, 2].map(|axis| {
            let [r0, r1, r2] = self.rotation[axis];
            let sum = _mm512_add_ps(_mm512_mul_ps(r0, x), _mm512_mul_ps(r1, y));
            let sum = _mm512_add_ps(sum, _mm512_mul_ps(r2, z));
            let scaled = _mm512_add_ps(sum, self.translation[axis]);
            _mm512_cvt_roundps_epi32::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(scaled)
        });
        // What is no number, or no i32, became i32::MIN: out of range as well.
        let [x, y, z] = index.map(|i| _mm512_sub_epi32(i, _mm512_set1_epi32(INDEX_MIN)));
        let from_min = _mm512_or_si512(_mm512_or_si512(x, y), z);
        let beyond = _mm512_set1_epi32(!(INDEX_MAX - INDEX_MIN));
        (index, _mm512_testn_epi32_mask(from_min, beyond))
    }
}

/// The twin of `sharding::shard_of_region`, for indices of a level.
struct Shards {
    shift: __m128i,
    /// The bits of an index that say which region it is in.
    region: __m512i,
}

impl Shards {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(region_shift: u32) -> Self {
        Self { shift: _mm_cvtsi32_si128(region_shift as i32), region: _mm512_set1_epi32(-1 << region_shift) }
    }

    /// Shifts once, for shifts are what the look-up has most of.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn of(&self, index: [__m512i; 3]) -> __m512i {
        let [x, y, z] = index.map(|i| _mm512_and_si512(i, self.region));
        let color = _mm512_slli_epi32::<2>(_mm512_add_epi32(y, z));
        let color = _mm512_add_epi32(color, _mm512_add_epi32(x, z));
        _mm512_and_si512(_mm512_srl_epi32(color, self.shift), _mm512_set1_epi32(SHARDS as i32 - 1))
    }
}
