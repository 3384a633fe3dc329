//! The look-up eight points at a time, for machines with AVX2 and without AVX-512.
//!
//! Every step does the same as one of [`super::scalar`]. A batch of points takes each step together: where the
//! voxels are, what to fetch for them, what is there; so the misses of a whole batch are on their way at once.
#![expect(unsafe_code, reason = "vector intrinsics and gathers from raw addresses")]

mod bloom;
pub(super) mod by_key;
mod exact;
mod locate;

use std::arch::x86_64::*;

use super::{LevelView, Lookup};
use crate::geometry::Point;
use crate::util;
use crate::util::cpu::Avx2;
use crate::voxel::LatticeFromPoints;
use crate::voxel::quantize::avx2::{LANES, pack_four};
use locate::Locator;

/// Points that take each step together: two words of answers.
const BATCH: usize = 128;

/// See [`super::occupied`].
pub(super) fn occupied(
    _: Avx2,
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: the token says that the CPU has the feature; `occupied` holds a bit a point (asserted by our caller).
    unsafe {
        match lookup {
            Lookup::Bloom => {
                run(points, &Locator::load(lattice_from_points, view), &bloom::Planes::of(view), occupied)
            }
            Lookup::Exact => {
                run(points, &Locator::load(lattice_from_points, view), &exact::Tables::of(view), occupied)
            }
        }
    }
}

/// Where a batch of points falls: indices of the view's level, axis by axis, and shards.
struct Batch {
    index: [[i32; BATCH]; 3],
    shard: [i32; BATCH],
}

impl Batch {
    const EMPTY: Self = Self { index: [[0; BATCH]; 3], shard: [0; BATCH] };
}

/// How a batch of voxels is looked up.
trait LookupKernel {
    /// A bit for each voxel of the batch: is it occupied?
    ///
    /// # Safety
    /// Needs AVX2; the view must still live.
    unsafe fn look_up(&self, batch: &Batch, points: usize) -> [u64; BATCH / 64];
}

/// # Safety
/// Needs AVX2, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx2")]
unsafe fn run(points: &[Point], locator: &Locator, probe: &impl LookupKernel, occupied: &mut [u64]) -> bool {
    let mut batch = Batch::EMPTY;
    let mut all_have_a_voxel = true;
    for (points, words) in points.chunks(BATCH).zip(occupied.chunks_mut(BATCH / 64)) {
        let mut has_voxel = [0u64; BATCH / 64];
        for (group, points) in points.chunks(LANES).enumerate() {
            let valid = locator.locate(points, group * LANES, &mut batch);
            let present = ((1u32 << points.len()) - 1) as u8;
            all_have_a_voxel &= valid & present == present;
            has_voxel[group / LANES] |= u64::from(valid & present) << (group % LANES * LANES);
        }
        // SAFETY: as for this function.
        let hits = unsafe { probe.look_up(&batch, points.len()) };
        for (i, word) in words.iter_mut().enumerate() {
            *word = hits[i] & has_voxel[i];
        }
    }
    all_have_a_voxel
}

/// Four packed keys (`VoxelKey::pack`) of the voxels from `at` on.
#[inline]
#[target_feature(enable = "avx2")]
fn pack(index: &[[i32; BATCH]; 3], at: usize) -> __m256i {
    // SAFETY: four i32 from `at` on; `at` is a multiple of four below the batch's size.
    pack_four([0, 1, 2].map(|axis| unsafe { _mm_loadu_si128(index[axis][at..at + 4].as_ptr().cast()) }))
}

/// The low 64 bits of each product; AVX2 multiplies 32 bits by 32 bits.
#[inline]
#[target_feature(enable = "avx2")]
fn multiply(a: __m256i, b: u64) -> __m256i {
    let (low, high) = (_mm256_set1_epi64x(b as i64), _mm256_set1_epi64x((b >> 32) as i64));
    let cross =
        _mm256_add_epi64(_mm256_mul_epu32(_mm256_srli_epi64::<32>(a), low), _mm256_mul_epu32(a, high));
    _mm256_add_epi64(_mm256_mul_epu32(a, low), _mm256_slli_epi64::<32>(cross))
}

/// The mix of the table (`Slots::home`).
#[inline]
#[target_feature(enable = "avx2")]
fn mix(key: __m256i, a: u64, b: u64) -> __m256i {
    let h = multiply(key, a);
    multiply(_mm256_xor_si256(h, _mm256_srli_epi64::<32>(h)), b)
}

/// high32(h) * n >> 32.
#[inline]
#[target_feature(enable = "avx2")]
fn scale(h: __m256i, n: __m256i) -> __m256i {
    _mm256_srli_epi64::<32>(_mm256_mul_epu32(_mm256_srli_epi64::<32>(h), n))
}

/// One value a shard for each of the four voxels from `at` on.
#[inline]
#[target_feature(enable = "avx2")]
fn of_shards(values: &[u64; super::SHARDS], shard: &[i32; BATCH], at: usize) -> __m256i {
    // SAFETY: four i32 from `at` on, each below the number of shards.
    unsafe {
        let shard = _mm_loadu_si128(shard[at..at + 4].as_ptr().cast());
        _mm256_i32gather_epi64::<8>(values.as_ptr().cast(), shard)
    }
}

/// The four lanes in memory.
#[inline]
#[target_feature(enable = "avx2")]
fn store(to: &mut [u64], lanes: __m256i) {
    debug_assert!(to.len() >= 4);
    // SAFETY: four u64 are one register, and `to` has room for them.
    unsafe { _mm256_storeu_si256(to[..4].as_mut_ptr().cast(), lanes) };
}

/// Starts fetching the line at an address.
#[inline(always)]
fn prefetch(address: u64) {
    util::prefetch::<u64>(std::ptr::with_exposed_provenance(address as usize));
}
