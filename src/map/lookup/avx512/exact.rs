//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::registers::{
    PerShard, addresses, gather, lanes, lengths, mix, pack, prefetch, scale, to_array, widen,
};
use super::{LANES, Probe};
use crate::map::lookup::LevelView;
use crate::voxel::{BLOCK_LEVELS, BUCKET, BlockMask, Bucket, Cell, Slots};

/// The table of blocks.
pub(super) struct Exact;

pub(super) struct ExactRegisters<'a> {
    view: &'a LevelView<'a>,
    keys: PerShard,
    masks: PerShard,
    buckets: PerShard,
}

/// Sixteen voxels on their way through the table; one at a time from here on, since each is compared with all
/// eight keys of its bucket at once.
#[derive(Clone, Copy)]
pub(super) struct LocatedBlocks {
    blocks: [u64; LANES],
    shards: [u64; LANES],
    /// Addresses of the home buckets.
    buckets: [u64; LANES],
    /// Addresses of the voxels' words in the masks of the first slots of those buckets.
    words: [u64; LANES],
    /// The bits that count in those words.
    within: [__m512i; 2],
}

/// What a voxel of an absent block reads.
static NO_VOXELS: u64 = 0;

impl Probe for Exact {
    type Registers<'a> = ExactRegisters<'a>;
    type Located = LocatedBlocks;
    /// Addresses of words of masks, and the bits that count there.
    type Found = ([u64; LANES], [__m512i; 2]);

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> ExactRegisters<'a> {
        ExactRegisters {
            view,
            keys: PerShard::load(addresses(view.blocks.map(|slots| slots.keys))),
            masks: PerShard::load(addresses(view.blocks.map(|slots| slots.masks))),
            buckets: PerShard::load(lengths(view.blocks.map(|slots| slots.keys))),
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn locate<const FAR: bool>(
        r: &ExactRegisters<'_>,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> LocatedBlocks {
        let up = r.view.up;
        let (left, right) = (_mm_cvtsi32_si128(up as i32), _mm_cvtsi32_si128((BLOCK_LEVELS - up) as i32));
        let blocks = pack(index.map(|i| _mm512_sra_epi32(i, right)));
        let cells = widen(cell(index.map(|i| _mm512_sll_epi32(i, left))));
        let shards = widen(shard);
        let bucket = |half: usize| {
            let h = mix(blocks[half], Slots::HASH_A, Slots::HASH_B);
            let bucket = scale(h, r.buckets.of(shards[half]));
            let keys = _mm512_add_epi64(r.keys.of(shards[half]), _mm512_slli_epi64::<6>(bucket));
            // A bucket's masks are 8 x 64 bytes.
            let masks = _mm512_add_epi64(r.masks.of(shards[half]), _mm512_slli_epi64::<9>(bucket));
            let word = _mm512_slli_epi64::<3>(_mm512_srli_epi64::<6>(cells[half]));
            (keys, _mm512_add_epi64(masks, word))
        };
        let (a, b) = (bucket(0), bucket(1));
        if FAR {
            // SAFETY: a prefetch never faults.
            unsafe {
                prefetch(a.0);
                prefetch(b.0);
            }
        }
        LocatedBlocks {
            blocks: to_array(blocks),
            shards: to_array(shards),
            buckets: to_array([a.0, b.0]),
            words: to_array([a.1, b.1]),
            within: [within(cells[0], up), within(cells[1], up)],
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn find<const FAR: bool>(r: &ExactRegisters<'_>, located: LocatedBlocks) -> Self::Found {
        let mut words = located.words;
        for (lane, word) in words.iter_mut().enumerate() {
            let block = located.blocks[lane];
            // SAFETY: the address is of a bucket of a shard's table, which the view keeps alive.
            let keys = unsafe {
                _mm512_loadu_si512(std::ptr::with_exposed_provenance(located.buckets[lane] as usize))
            };
            let equal = _mm512_cmpeq_epi64_mask(keys, _mm512_set1_epi64(block as i64));
            let in_slot =
                located.words[lane] + u64::from(equal.trailing_zeros()) * size_of::<BlockMask>() as u64;
            let absent = (&raw const NO_VOXELS).expose_provenance() as u64;
            *word = if equal != 0 { in_slot } else { absent };
            let full = _mm512_movepi64_mask(keys) & 0x80 == 0;
            if equal == 0 && full {
                *word = r.find_beyond(block, located.shards[lane], located.words[lane]).unwrap_or(absent);
            }
            if FAR {
                _mm_prefetch::<_MM_HINT_T0>(std::ptr::with_exposed_provenance(*word as usize));
            }
        }
        (words, located.within)
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn answer(_: &ExactRegisters<'_>, (words, within): Self::Found) -> u16 {
        // SAFETY: sixteen u64 are two registers; each is the address of a word of a mask that the view keeps alive,
        // or of `NO_VOXELS`.
        let voxels = unsafe {
            let [a, b] = [0, 8].map(|i| _mm512_loadu_si512(words[i..].as_ptr().cast()));
            [gather(a), gather(b)]
        };
        let hit = |half: usize| _mm512_test_epi64_mask(voxels[half], within[half]);
        u16::from(hit(0)) | u16::from(hit(1)) << 8
    }
}

impl ExactRegisters<'_> {
    /// The address of a voxel's word where its block is not in its home bucket, which is full. `home_word` is what
    /// it would be in the home bucket's first slot.
    #[cold]
    fn find_beyond(&self, block: u64, shard: u64, home_word: u64) -> Option<u64> {
        let slots = self.view.blocks[shard as usize];
        let first_slot = Slots::home(block, slots.keys.len()) * BUCKET;
        let slot = slots.find(block)?;
        let moved = (slot as u64).wrapping_sub(first_slot as u64).wrapping_mul(size_of::<BlockMask>() as u64);
        Some(home_word.wrapping_add(moved))
    }
}

const _: () =
    assert!(size_of::<Bucket>() == 64 && size_of::<BlockMask>() == 64, "as the shifts above take them");

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
