//! From points to voxel indices and shards.

use std::arch::x86_64::*;

use crate::geometry::Point;
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::SHARDS;
use crate::voxel::LatticeFromPoints;
use crate::voxel::quantize::avx512::Quantizer;

/// Finds the voxels of points, and the shards that these are in.
pub(super) struct Locator {
    quantizer: Quantizer,
    shards: Shards,
}

impl Locator {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(lattice_from_points: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        Self {
            quantizer: Quantizer::load(lattice_from_points, view.level),
            shards: Shards::load(view.region_shift),
        }
    }

    /// Indices, shards, and a bit for each of up to sixteen points that has them.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn locate(&self, points: &[Point]) -> ([__m512i; 3], __m512i, u16) {
        let (index, valid) = self.quantizer.index(points);
        (index, self.shards.of(index), valid)
    }
}

/// The SIMD variant of `sharding::shard_of_region`, for indices of a level.
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
