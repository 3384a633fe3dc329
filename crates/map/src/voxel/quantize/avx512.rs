//! Quantization of sixteen points at a time, for CPUs with AVX-512.
#![expect(
    unsafe_code,
    reason = "vector intrinsics, and functions that are compiled for more than the crate is"
)]

use std::arch::x86_64::*;

use super::scalar::NO_KEY;
use crate::geometry::Point;
use crate::util::cpu::Avx512;
use crate::voxel::key::{INDEX_MAX, INDEX_MIN};
use crate::voxel::lattice::LatticeFromPoints;

/// Points of one f32 register.
pub const LANES: usize = 16;

/// See [`super::keys`].
pub(super) fn keys(_: Avx512, points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    // SAFETY: the token says that the CPU has the features.
    unsafe { all_keys(points, t, level, keys) }
}

#[target_feature(enable = "avx512f,avx512dq")]
fn all_keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    let (quantizer, none) = (Quantizer::load(t, level), _mm512_set1_epi64(NO_KEY as i64));
    for (points, keys) in points.chunks(LANES).zip(keys.chunks_mut(LANES)) {
        let (index, valid) = quantizer.index(points);
        let [a, b] = pack(index);
        let present = (1u32 << keys.len()) - 1;
        let (a, b) =
            (_mm512_mask_mov_epi64(none, valid as u8, a), _mm512_mask_mov_epi64(none, (valid >> 8) as u8, b));
        // SAFETY: the stores are masked to the keys that are.
        unsafe {
            _mm512_mask_storeu_epi64(keys.as_mut_ptr().cast(), present as u8, a);
            _mm512_mask_storeu_epi64(keys.as_mut_ptr().wrapping_add(8).cast(), (present >> 8) as u8, b);
        }
    }
}

/// The transform and the level, spread over lanes.
pub struct Quantizer {
    rotation: [[__m512; 3]; 3],
    translation: [__m512; 3],
    level: u32,
}

impl Quantizer {
    /// The transform and the level, in every lane.
    ///
    /// # Safety
    /// Needs AVX-512 F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn load(t: &LatticeFromPoints, level: u32) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm512_set1_ps(r))),
            translation: t.translation.map(|c| _mm512_set1_ps(c)),
            level,
        }
    }

    /// Indices of the level of up to sixteen points, axis by axis, and a bit for each that has a voxel: the SIMD
    /// variant of [`LatticeFromPoints::index`].
    ///
    /// # Safety
    /// Needs AVX-512 F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn index(&self, points: &[Point]) -> ([__m512i; 3], u16) {
        let [x, y, z] = deinterleave(load(points));
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
        let valid = _mm512_testn_epi32_mask(from_min, beyond);
        let index = match self.level {
            0 => index,
            level => index.map(|i| _mm512_sra_epi32(i, _mm_cvtsi32_si128(level as i32))),
        };
        (index, valid)
    }
}

/// The 48 coordinates of up to sixteen points, zeros after the last.
#[inline]
#[target_feature(enable = "avx512f")]
fn load(points: &[Point]) -> [__m512; 3] {
    if points.len() < LANES {
        return load_tail(points);
    }
    // SAFETY: sixteen points are 48 f32, at any alignment.
    unsafe { [0, 1, 2].map(|i| _mm512_loadu_ps(points.as_ptr().cast::<f32>().add(i * LANES))) }
}

#[cold]
#[target_feature(enable = "avx512f")]
fn load_tail(points: &[Point]) -> [__m512; 3] {
    let mut sixteen = [Point::new(0.0, 0.0, 0.0); LANES];
    sixteen[..points.len()].copy_from_slice(points);
    load(&sixteen)
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
fn deinterleave([a, b, c]: [__m512; 3]) -> [__m512; 3] {
    const ORDER: [[i32; LANES]; 3] = [order_of(0), order_of(1), order_of(2)];
    const OF_B: [u16; 3] = [lanes_of(0, 1), lanes_of(1, 1), lanes_of(2, 1)];
    const OF_C: [u16; 3] = [lanes_of(0, 2), lanes_of(1, 2), lanes_of(2, 2)];
    [0, 1, 2].map(|axis| {
        let mixed = _mm512_mask_blend_ps(OF_C[axis], _mm512_mask_blend_ps(OF_B[axis], a, b), c);
        _mm512_permutexvar_ps(lanes(&ORDER[axis]), mixed)
    })
}

/// Sixteen i32 in a register.
#[inline]
#[target_feature(enable = "avx512f")]
pub(crate) fn lanes(values: &[i32; LANES]) -> __m512i {
    // SAFETY: sixteen i32 are one register.
    unsafe { _mm512_loadu_si512(values.as_ptr().cast()) }
}

/// Low and high halves of sixteen packed keys (`VoxelKey::pack`).
#[inline]
#[target_feature(enable = "avx512f")]
pub(crate) fn halves(index: [__m512i; 3]) -> [__m512i; 2] {
    let field = _mm512_set1_epi32(0x1f_ffff);
    let [x, y, z] = index.map(|i| _mm512_and_si512(i, field));
    let low = _mm512_or_si512(x, _mm512_slli_epi32::<21>(y));
    [low, _mm512_or_si512(_mm512_srli_epi32::<11>(y), _mm512_slli_epi32::<10>(z))]
}

/// Sixteen packed keys, eight a register.
#[inline]
#[target_feature(enable = "avx512f")]
pub(crate) fn pack(index: [__m512i; 3]) -> [__m512i; 2] {
    let [low, high] = halves(index);
    const FIRST: [i32; LANES] = [0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23];
    const SECOND: [i32; LANES] = [8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31];
    [FIRST, SECOND].map(|index| _mm512_permutex2var_epi32(low, lanes(&index), high))
}
