//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::registers::{
    PerShard, addresses, eight_of, gather_now, lanes, lengths, load, mix, pack, prefetch_now, scale, store,
    to_array, widen,
};
use super::{GROUPS, LANES, Probe, WORD};
use crate::map::lookup::LevelView;
use crate::voxel::{BLOCK_LEVELS, BlockMask, Bucket, CacheLine, Cell, Slots};

/// The table of blocks.
///
/// Neighbours in a scan lie in one block more often than not: a point beside the one before it, or beside what the
/// sensor saw one turn of its lasers ago, which for 16, 32 or 64 of them is the same lane of the word before. A block
/// that is known from either is not searched for.
///
/// ```text
/// locate   blocks and cells of sixteen voxels
/// seek     those of 64 in a new block are sought: tags say which slots may be theirs; keys and masks are fetched
/// answer   the keys decide; each voxel gets the address of its block's mask, and asks for its word there
/// ```
///
/// With `FETCH`, keys and masks are fetched as soon as tags say where they are.
pub(super) struct Exact<const FETCH: bool>;

pub(super) struct ExactRegisters<'a> {
    view: &'a LevelView<'a>,
    tags: PerShard,
    keys: PerShard,
    masks: PerShard,
    buckets: PerShard,
    /// All lanes where a block is larger than a region and has a part in each of several shards: a block that is known
    /// from one is sought in the other all the same.
    always: u8,
}

/// Eights of voxels in a word: what a register holds.
const EIGHTS: usize = WORD / 8;
/// A register more than there are voxels: whole registers are stored behind one another.
const QUEUE: usize = WORD + 8;

/// Sixteen voxels.
pub(super) struct Located {
    blocks: [__m512i; 2],
    cells: [__m512i; 2],
    shards: [__m512i; 2],
}

/// A word of voxels.
pub(super) struct ExactWord {
    cells: [__m512i; EIGHTS],
    /// A bit for each in another block than the lane before it.
    heads: u64,
    /// Those of them that are sought, since they lie in another block than the same lane of the word before.
    sought: u64,
    searches: [Search; EIGHTS],
    /// How many of the searches are this word's.
    searches_used: usize,
}

/// What is known from the word before.
pub(super) struct ExactMemory {
    blocks: [__m512i; EIGHTS],
    /// Addresses of the blocks' masks.
    masks: [__m512i; EIGHTS],
    /// Blocks that are sought, and their shards.
    queue: ([u64; QUEUE], [u64; QUEUE]),
    /// Addresses of the masks that were found.
    found: [u64; QUEUE],
}

/// Eight blocks on their way through the table.
///
/// A bucket's tags say which slot may hold a block, and so where its key and its mask are: both are fetched at once.
/// That the key is the block's is checked when it is there.
#[derive(Clone, Copy)]
struct Search {
    blocks: __m512i,
    shards: __m512i,
    /// Addresses of the keys of the first slots whose tags fit, and of the masks.
    keys: __m512i,
    masks: __m512i,
    /// Those with such a slot.
    tagged: u8,
    /// Those whose home bucket is full: the block may be in another.
    full: u8,
}

/// Stands for the blocks of points without a voxel; no key sets bit 63.
const NO_BLOCK: __m512i = eight_of(u64::MAX);
/// The mask of a block that is not there.
static ABSENT: CacheLine<BlockMask> = CacheLine(BlockMask::EMPTY);

impl Default for ExactMemory {
    /// Known is what is not there.
    #[inline(always)]
    fn default() -> Self {
        let absent = eight_of((&raw const ABSENT).expose_provenance() as u64);
        Self {
            blocks: [NO_BLOCK; EIGHTS],
            masks: [absent; EIGHTS],
            queue: ([0; QUEUE], [0; QUEUE]),
            found: [0; QUEUE],
        }
    }
}

impl<const FETCH: bool> Probe for Exact<FETCH> {
    type Registers<'a> = ExactRegisters<'a>;
    type Located = Located;
    type Word = ExactWord;
    type Memory = ExactMemory;

    /// One more than for filters: a word of neighbours needs few lines.
    const AHEAD: usize = 3;
    const NO_WORD: ExactWord = {
        let none = eight_of(0);
        let search = Search { blocks: none, shards: none, keys: none, masks: none, tagged: 0, full: 0 };
        ExactWord { cells: [none; EIGHTS], heads: 0, sought: 0, searches: [search; EIGHTS], searches_used: 0 }
    };

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> ExactRegisters<'a> {
        ExactRegisters {
            view,
            tags: PerShard::load(addresses(view.blocks.map(|slots| slots.tags))),
            keys: PerShard::load(addresses(view.blocks.map(|slots| slots.keys))),
            masks: PerShard::load(addresses(view.blocks.map(|slots| slots.masks))),
            buckets: PerShard::load(lengths(view.blocks.map(|slots| slots.keys))),
            always: if BLOCK_LEVELS - view.up > view.region_shift { u8::MAX } else { 0 },
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn locate(r: &ExactRegisters<'_>, index: [__m512i; 3], shard: __m512i, valid: u16) -> Located {
        let up = r.view.up;
        let (left, right) = (_mm_cvtsi32_si128(up as i32), _mm_cvtsi32_si128((BLOCK_LEVELS - up) as i32));
        let [a, b] = pack(index.map(|i| _mm512_sra_epi32(i, right)));
        let finest = if up == 0 { index } else { index.map(|i| _mm512_sll_epi32(i, left)) };
        // What is out of range may have the key of a block in another shard.
        let blocks = [
            _mm512_mask_mov_epi64(NO_BLOCK, valid as u8, a),
            _mm512_mask_mov_epi64(NO_BLOCK, (valid >> 8) as u8, b),
        ];
        let cells = widen(cell(finest));
        Located { blocks, cells, shards: widen(shard) }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn seek(
        r: &ExactRegisters<'_>,
        memory: &mut ExactMemory,
        located: [Located; GROUPS],
        word: &mut ExactWord,
    ) {
        let sought = word.queue_new_blocks(&located, memory, r.always);
        word.searches_used = sought.div_ceil(8);
        for (i, search) in word.searches[..word.searches_used].iter_mut().enumerate() {
            let (blocks, shards) = (load(&memory.queue.0, 8 * i), load(&memory.queue.1, 8 * i));
            // SAFETY: as for this function.
            *search = unsafe { r.search::<FETCH>(blocks, shards) };
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn answer(r: &ExactRegisters<'_>, memory: &mut ExactMemory, word: &ExactWord) -> u64 {
        for (i, search) in word.searches[..word.searches_used].iter().enumerate() {
            // SAFETY: as for this function.
            store(&mut memory.found, 8 * i, unsafe { r.masks_of(search) });
        }
        let (mut hits, mut taken, mut before) = (0, 0, memory.masks[EIGHTS - 1]);
        for i in 0..EIGHTS {
            let (heads, sought) = ((word.heads >> (8 * i)) as u8, (word.sought >> (8 * i)) as u8);
            let found = load(&memory.found, taken);
            let masks = _mm512_mask_expand_epi64(memory.masks[i], sought, found);
            taken += sought.count_ones() as usize;
            before = _mm512_permutex2var_epi64(masks, latest_of(heads), before);
            memory.masks[i] = before;
            let addresses =
                _mm512_add_epi64(before, _mm512_slli_epi64::<3>(_mm512_srli_epi64::<6>(word.cells[i])));
            // SAFETY: each address is of a word of a mask that the view keeps alive, or of `ABSENT`.
            let words = unsafe { gather_now(addresses) };
            let hit = _mm512_test_epi64_mask(words, within(word.cells[i], r.view.up));
            hits |= u64::from(hit) << (8 * i);
        }
        hits
    }
}

impl ExactWord {
    /// Finds the blocks that are not known yet; the number of them.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn queue_new_blocks(
        &mut self,
        located: &[Located; GROUPS],
        memory: &mut ExactMemory,
        always: u8,
    ) -> usize {
        let (mut queued, mut before) = (0, memory.blocks[EIGHTS - 1]);
        (self.heads, self.sought) = (0, 0);
        for i in 0..EIGHTS {
            let Located { blocks, cells, shards } = &located[i / 2];
            let blocks = blocks[i % 2];
            self.cells[i] = cells[i % 2];
            let heads = _mm512_cmpneq_epi64_mask(blocks, _mm512_alignr_epi64::<7>(blocks, before)) | always;
            let sought = heads & (_mm512_cmpneq_epi64_mask(blocks, memory.blocks[i]) | always);
            self.heads |= u64::from(heads) << (8 * i);
            self.sought |= u64::from(sought) << (8 * i);
            store(&mut memory.queue.0, queued, _mm512_maskz_compress_epi64(sought, blocks));
            store(&mut memory.queue.1, queued, _mm512_maskz_compress_epi64(sought, shards[i % 2]));
            queued += sought.count_ones() as usize;
            memory.blocks[i] = blocks;
            before = blocks;
        }
        queued
    }
}

impl ExactRegisters<'_> {
    /// # Safety
    /// Needs AVX-512 F, DQ and CD; the view must still live.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn search<const FETCH: bool>(&self, blocks: __m512i, shards: __m512i) -> Search {
        let h = mix(blocks, Slots::HASH_A, Slots::HASH_B);
        let bucket = scale(h, self.buckets.of(shards));
        let tags_address = _mm512_add_epi64(self.tags.of(shards), _mm512_slli_epi64::<3>(bucket));
        // SAFETY: the address is of a bucket's tags of a shard's table, which the view keeps alive.
        let tags = unsafe { gather_now(tags_address) };
        // The place of the first tag that fits, times eight: each takes a byte, as a key does a u64.
        let fits = fitting(tags, h);
        let first = _mm512_sub_epi64(_mm512_set1_epi64(63), _mm512_lzcnt_epi64(fits));
        let place = _mm512_and_si512(first, _mm512_set1_epi64(!7));
        let tagged = _mm512_test_epi64_mask(fits, fits);
        let keys =
            _mm512_add_epi64(self.keys.of(shards), _mm512_add_epi64(_mm512_slli_epi64::<6>(bucket), place));
        let slot = _mm512_add_epi64(_mm512_slli_epi64::<9>(bucket), _mm512_slli_epi64::<3>(place));
        let masks = _mm512_add_epi64(self.masks.of(shards), slot);
        let (keys, masks) =
            (_mm512_mask_mov_epi64(absent(), tagged, keys), _mm512_mask_mov_epi64(absent(), tagged, masks));
        if FETCH {
            prefetch_now(keys);
            prefetch_now(masks);
        }
        let full = _mm512_test_epi64_mask(tags, _mm512_set1_epi64(0xff << 56));
        Search { blocks, shards, keys, masks, tagged, full }
    }

    /// The addresses of the blocks' masks.
    ///
    /// # Safety
    /// As for `search`.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn masks_of(&self, search: &Search) -> __m512i {
        // SAFETY: each address is of a key that the view keeps alive, or of `ABSENT`.
        let keys = unsafe { gather_now(search.keys) };
        let is_block = _mm512_cmpeq_epi64_mask(keys, search.blocks) & search.tagged;
        let masks = _mm512_mask_mov_epi64(absent(), is_block, search.masks);
        let elsewhere = !is_block & (search.tagged | search.full);
        if elsewhere == 0 { masks } else { self.masks_elsewhere(search, masks, elsewhere) }
    }

    /// Those of blocks that are not in the first slots whose tags fit as well.
    #[cold]
    #[target_feature(enable = "avx512f")]
    fn masks_elsewhere(&self, search: &Search, masks: __m512i, elsewhere: u8) -> __m512i {
        let [blocks, shards, mut masks] = [search.blocks, search.shards, masks].map(|lanes| to_array(lanes));
        for lane in (0..8).filter(|lane| elsewhere >> lane & 1 == 1) {
            let slots = self.view.blocks[shards[lane] as usize];
            if let Some(slot) = slots.find(blocks[lane]) {
                masks[lane] = (&raw const slots.masks[slot]).expose_provenance() as u64;
            }
        }
        load(&masks, 0)
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn absent() -> __m512i {
    _mm512_set1_epi64((&raw const ABSENT).expose_provenance() as i64)
}

/// For each of eight lanes the latest head, itself or before it; the last lane of the eight before where there is none.
#[inline]
#[target_feature(enable = "avx512f")]
fn latest_of(heads: u8) -> __m512i {
    const LAST_BEFORE: u8 = 15;
    static LATEST: [[u8; 8]; 256] = {
        let mut latest = [[LAST_BEFORE; 8]; 256];
        let mut heads = 0;
        while heads < 256 {
            let (mut lane, mut head) = (0, LAST_BEFORE);
            while lane < 8 {
                if heads >> lane & 1 == 1 {
                    head = lane as u8;
                }
                latest[heads][lane] = head;
                lane += 1;
            }
            heads += 1;
        }
        latest
    };
    _mm512_cvtepu8_epi64(_mm_cvtsi64_si128(i64::from_le_bytes(LATEST[usize::from(heads)])))
}

const _: () = assert!(
    size_of::<Bucket>() == 64 && size_of::<CacheLine<BlockMask>>() == 64,
    "as the shifts above take them"
);

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
    const SPREAD: [[i32; LANES]; 3] = {
        let mut spread = [[0; LANES]; 3];
        let mut i = 0;
        while i < 3 * LANES {
            spread[i / LANES][i % LANES] = ((Cell::SPREAD >> ((i & 7) * 8)) as i32 & 0xff) << (i / LANES);
            i += 1;
        }
        spread
    };
    let [x, y, z] = [0, 1, 2].map(|axis| _mm512_permutexvar_epi32(index[axis], lanes(&SPREAD[axis])));
    _mm512_or_si512(_mm512_or_si512(x, y), z)
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
