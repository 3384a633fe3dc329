//! From points to voxel indices and shards.

use std::arch::x86_64::*;

use super::kernel::Batch;
use crate::geometry::Point;
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::SHARDS;
use crate::voxel::LatticeFromPoints;
use crate::voxel::quantize::avx2::{LANES, Quantizer};

/// Finds the voxels of points, and the shards that these are in.
pub(super) struct Locator {
    quantizer: Quantizer,
    region_shift: __m128i,
}

impl Locator {
    #[target_feature(enable = "avx2")]
    pub(super) fn load(t: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        let region_shift = _mm_cvtsi32_si128(view.region_shift as i32);
        Self { quantizer: Quantizer::load(t, view.level), region_shift }
    }

    /// Writes where up to eight points fall to the batch, from `at` on; a bit for each that has a voxel.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn locate(&self, points: &[Point], at: usize, batch: &mut Batch) -> u8 {
        let (index, valid) = self.quantizer.index(points);
        for (axis, index) in batch.index.iter_mut().zip(index) {
            write(&mut axis[at..], index);
        }
        write(&mut batch.shard[at..], shard(index.map(|i| _mm256_sra_epi32(i, self.region_shift))));
        valid
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn write(to: &mut [i32], lanes: __m256i) {
    // SAFETY: eight i32 are one register, and the slice has room for them (it is indexed to say so).
    unsafe { _mm256_storeu_si256(to[..LANES].as_mut_ptr().cast(), lanes) };
}

/// The SIMD variant of `sharding::shard_of_region`.
#[inline]
#[target_feature(enable = "avx2")]
fn shard([x, y, z]: [__m256i; 3]) -> __m256i {
    let color = _mm256_slli_epi32::<2>(_mm256_add_epi32(y, z));
    let color = _mm256_add_epi32(color, _mm256_add_epi32(x, z));
    _mm256_and_si256(color, _mm256_set1_epi32(SHARDS as i32 - 1))
}
