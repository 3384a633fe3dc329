//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::registers::{
    PerShard, addresses, gather, lanes, lengths, mix, pack, prefetch, scale, to_array, widen,
};
use super::{LANES, Probe};
use crate::map::lookup::{LevelView, scalar};
use crate::voxel::{BLOCK_LEVELS, BlockMask, Bucket, Cell, Slots, VoxelKey};

/// The table of blocks.
pub(super) struct Exact;

pub(super) struct ExactRegisters<'a> {
    view: &'a LevelView<'a>,
    tags: PerShard,
    keys: PerShard,
    masks: PerShard,
    buckets: PerShard,
}

/// Eight voxels on their way through the table.
///
/// A bucket's tags say which slot may hold the block, and so where its key and the voxel's word are: both are
/// fetched at once. That the key is the block's is checked when it is there.
pub(super) struct Located {
    blocks: __m512i,
    cells: __m512i,
    /// Addresses of the keys of the first slots whose tags fit, and of the voxels' words in their masks.
    keys: __m512i,
    words: __m512i,
    /// Those with such a slot.
    tagged: u8,
    /// Those whose home bucket is full: the block may be in another.
    full: u8,
}

/// What a voxel without a slot reads.
static NOTHING: u64 = 0;

impl Probe for Exact {
    type Registers<'a> = ExactRegisters<'a>;
    type Located = [Located; 2];

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> ExactRegisters<'a> {
        ExactRegisters {
            view,
            tags: PerShard::load(addresses(view.blocks.map(|slots| slots.tags))),
            keys: PerShard::load(addresses(view.blocks.map(|slots| slots.keys))),
            masks: PerShard::load(addresses(view.blocks.map(|slots| slots.masks))),
            buckets: PerShard::load(lengths(view.blocks.map(|slots| slots.keys))),
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn locate<const FETCH: bool>(
        r: &ExactRegisters<'_>,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> [Located; 2] {
        let up = r.view.up;
        let (left, right) = (_mm_cvtsi32_si128(up as i32), _mm_cvtsi32_si128((BLOCK_LEVELS - up) as i32));
        let blocks = pack(index.map(|i| _mm512_sra_epi32(i, right)));
        let cells = widen(cell(index.map(|i| _mm512_sll_epi32(i, left))));
        let shards = widen(shard);
        // SAFETY: as for this function.
        [0, 1].map(|half| unsafe { r.locate::<FETCH>(blocks[half], cells[half], shards[half]) })
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn answer(r: &ExactRegisters<'_>, [a, b]: &[Located; 2]) -> u16 {
        // SAFETY: as for this function.
        unsafe { u16::from(r.answer(a)) | u16::from(r.answer(b)) << 8 }
    }
}

impl ExactRegisters<'_> {
    /// # Safety
    /// Needs AVX-512 F, DQ and CD; the view must still live.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn locate<const FETCH: bool>(&self, blocks: __m512i, cells: __m512i, shards: __m512i) -> Located {
        let h = mix(blocks, Slots::HASH_A, Slots::HASH_B);
        let bucket = scale(h, self.buckets.of(shards));
        let tags_address = _mm512_add_epi64(self.tags.of(shards), _mm512_slli_epi64::<3>(bucket));
        // SAFETY: the address is of a bucket's tags of a shard's table, which the view keeps alive.
        let tags = unsafe { gather(tags_address) };
        // The place of the first tag that fits, times eight: each takes a byte, as a key does a u64.
        let fits = fitting(tags, h);
        let first = _mm512_sub_epi64(_mm512_set1_epi64(63), _mm512_lzcnt_epi64(fits));
        let place = _mm512_and_si512(first, _mm512_set1_epi64(!7));
        let tagged = _mm512_test_epi64_mask(fits, fits);
        let keys =
            _mm512_add_epi64(self.keys.of(shards), _mm512_add_epi64(_mm512_slli_epi64::<6>(bucket), place));
        let mask = _mm512_add_epi64(_mm512_slli_epi64::<9>(bucket), _mm512_slli_epi64::<3>(place));
        let word = _mm512_slli_epi64::<3>(_mm512_srli_epi64::<6>(cells));
        let words = _mm512_add_epi64(_mm512_add_epi64(self.masks.of(shards), mask), word);
        let nothing = _mm512_set1_epi64((&raw const NOTHING).expose_provenance() as i64);
        let (keys, words) =
            (_mm512_mask_mov_epi64(nothing, tagged, keys), _mm512_mask_mov_epi64(nothing, tagged, words));
        if FETCH {
            // SAFETY: a prefetch never faults.
            unsafe {
                prefetch(keys);
                prefetch(words);
            }
        }
        let full = _mm512_test_epi64_mask(tags, _mm512_set1_epi64(0xff << 56));
        Located { blocks, cells, keys, words, tagged, full }
    }

    /// # Safety
    /// As for `locate`.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn answer(&self, found: &Located) -> u8 {
        // SAFETY: each address is of a key, or of a word of a mask, that the view keeps alive, or of `NOTHING`.
        let (keys, words) = unsafe { (gather(found.keys), gather(found.words)) };
        let is_block = _mm512_cmpeq_epi64_mask(keys, found.blocks) & found.tagged;
        let hits = _mm512_test_epi64_mask(words, within(found.cells, self.view.up)) & is_block;
        let elsewhere = !is_block & (found.tagged | found.full);
        if elsewhere == 0 { hits } else { hits | self.answer_elsewhere(found, elsewhere) }
    }

    /// The answers for voxels whose blocks are not in the first slots whose tags fit.
    #[cold]
    #[target_feature(enable = "avx512f")]
    fn answer_elsewhere(&self, found: &Located, elsewhere: u8) -> u8 {
        let [blocks, cells] = [found.blocks, found.cells].map(|lanes| to_array(lanes));
        let contains = |&lane: &usize| {
            let voxel = VoxelKey::from_bits(blocks[lane])
                .map(|block| Cell::from_bits(cells[lane] as u16).voxel(block).ancestor(self.view.up));
            voxel.is_some_and(|voxel| scalar::exact(self.view, voxel.index()))
        };
        let lanes = (0..8).filter(|lane| elsewhere >> lane & 1 == 1);
        lanes.filter(contains).fold(0, |hits, lane| hits | 1 << lane)
    }
}

const _: () =
    assert!(size_of::<Bucket>() == 64 && size_of::<BlockMask>() == 64, "as the shifts above take them");

/// The top bit of each byte of `tags` that is the tag of a key with hash `h`; of bytes beyond the first such, it may be
/// set without reason. The twin of `Slots::tag`.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn fitting(tags: __m512i, h: __m512i) -> __m512i {
    let each = _mm512_set1_epi64(0x0101_0101_0101_0101);
    let tag = _mm512_and_si512(_mm512_srli_epi64::<{ Slots::TAG_SHIFT }>(h), _mm512_set1_epi64(0xff));
    let tag = _mm512_max_epu64(tag, _mm512_set1_epi64(1));
    let difference = _mm512_xor_si512(tags, _mm512_mullo_epi64(tag, each));
    let borrows = _mm512_andnot_si512(difference, _mm512_sub_epi64(difference, each));
    let zeros = _mm512_and_si512(borrows, _mm512_slli_epi64::<7>(each));
    // Only the lowest.
    _mm512_and_si512(zeros, _mm512_sub_epi64(_mm512_setzero_si512(), zeros))
}

/// The twin of [`Cell::of`], for sixteen indices.
#[inline]
#[target_feature(enable = "avx512f")]
fn cell(index: [__m512i; 3]) -> __m512i {
    // The permutation looks at four bits of an index; the fourth selects the same values again.
    const SPREAD: [i32; LANES] = {
        let mut spread = [0; LANES];
        let mut i = 0;
        while i < LANES {
            spread[i] = (Cell::SPREAD >> ((i & 7) * 8)) as i32 & 0xff;
            i += 1;
        }
        spread
    };
    let [x, y, z] = index.map(|i| _mm512_permutexvar_epi32(i, lanes(&SPREAD)));
    _mm512_or_si512(x, _mm512_or_si512(_mm512_slli_epi32::<1>(y), _mm512_slli_epi32::<2>(z)))
}

/// The twin of `BlockMask::within`.
#[inline]
#[target_feature(enable = "avx512f")]
fn within(cell: __m512i, up: u32) -> __m512i {
    match up {
        0 => _mm512_sllv_epi64(_mm512_set1_epi64(1), _mm512_and_si512(cell, _mm512_set1_epi64(63))),
        1 => _mm512_sllv_epi64(_mm512_set1_epi64(0xff), _mm512_and_si512(cell, _mm512_set1_epi64(0b11_1000))),
        _ => _mm512_set1_epi64(-1),
    }
}
