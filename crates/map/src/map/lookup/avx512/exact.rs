//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::kernel::{GROUPS, LookupKernel, WORD};
use super::registers::{eight_of, gather_now, load, prefetch_now, store, widen};
use super::tables::{CELL_BITS, Found, Tables, within_shard};
use crate::map::lookup::level_view::LevelView;
use crate::voxel::quantize::avx512::{LANES, lanes, pack};
use crate::voxel::{BLOCK_LEVELS, CLUSTER_LEVELS, Cell};

/// The table of blocks.
///
/// Neighbors in a scan lie in one cluster more often than not: a point beside the one before it, or beside what the
/// sensor saw one turn of its lasers ago, which for 16, 32 or 64 of them is the same lane of the word before. A cluster
/// that is known from either is not searched for, and where in it a block's mask is takes no memory to find out.
///
/// ```text
/// locate   clusters of sixteen voxels, and their cells in them
/// seek     those of 64 in a new cluster are sought; each voxel gets the address of its word in its block's mask,
///          which is fetched
/// answer   the words decide
/// ```
///
/// With `FETCH`, masks are fetched as soon as it is known where they are.
pub(super) struct Exact<const FETCH: bool>;

pub(super) struct ExactRegisters<'a> {
    tables: Tables<'a>,
    up: u32,
}

/// Eights of voxels in a word: what a register holds.
const EIGHTS: usize = WORD / 8;
/// A register more than there are voxels: whole registers are stored behind one another.
const QUEUE: usize = WORD + 8;

/// Sixteen voxels.
pub(super) struct Located {
    /// Their clusters: see [`within_shard`].
    clusters: [__m512i; 2],
    /// Numbers of their cells within their clusters.
    cells: [__m512i; 2],
}

/// A word of voxels.
pub(super) struct ExactWord {
    cells: [__m512i; EIGHTS],
    /// Addresses of their words of their blocks' masks.
    words: [__m512i; EIGHTS],
}

/// What is known from the word before, and room to search.
pub(super) struct ExactMemory {
    clusters: [__m512i; EIGHTS],
    found: [Found; EIGHTS],
    /// Clusters that are sought.
    queue: [u64; QUEUE],
    /// What was found of them, as [`Found`] has it.
    results: ([u64; QUEUE], [u64; QUEUE]),
}

/// Stands for the clusters of points without a voxel; no key sets bit 63. Where it is sought it may be found, in a
/// vacant slot, without a block.
const NO_CLUSTER: __m512i = eight_of(u64::MAX);
impl Default for ExactMemory {
    /// Known is what is not there.
    #[inline(always)]
    fn default() -> Self {
        let none = Found { present: eight_of(0), masks: eight_of(0) };
        Self {
            clusters: [NO_CLUSTER; EIGHTS],
            found: [none; EIGHTS],
            queue: [0; QUEUE],
            results: ([0; QUEUE], [0; QUEUE]),
        }
    }
}

impl<const FETCH: bool> LookupKernel for Exact<FETCH> {
    type Registers<'a> = ExactRegisters<'a>;
    type Located = Located;
    type Word = ExactWord;
    type Memory = ExactMemory;

    /// One more than for filters: a word of neighbors needs few lines.
    const AHEAD: usize = 3;
    const NO_WORD: ExactWord = ExactWord { cells: [eight_of(0); EIGHTS], words: [eight_of(0); EIGHTS] };

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> ExactRegisters<'a> {
        ExactRegisters { tables: Tables::load(view), up: view.up }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn locate(r: &ExactRegisters<'_>, index: [__m512i; 3], shard: __m512i, valid: u16) -> Located {
        let up = r.up;
        let to_cluster = _mm_cvtsi32_si128((BLOCK_LEVELS + CLUSTER_LEVELS - up) as i32);
        let keys = pack(index.map(|i| _mm512_sra_epi32(i, to_cluster)));
        let to_finest = _mm_cvtsi32_si128(up as i32);
        let finest = if up == 0 { index } else { index.map(|i| _mm512_sll_epi32(i, to_finest)) };
        let shards = widen(shard);
        // What is out of range may have the key of a cluster in another shard.
        let clusters = [
            _mm512_mask_mov_epi64(NO_CLUSTER, valid as u8, within_shard(keys[0], shards[0])),
            _mm512_mask_mov_epi64(NO_CLUSTER, (valid >> 8) as u8, within_shard(keys[1], shards[1])),
        ];
        Located { clusters, cells: widen(cell(finest)) }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn seek(
        r: &ExactRegisters<'_>,
        memory: &mut ExactMemory,
        located: [Located; GROUPS],
        word: &mut ExactWord,
    ) {
        let new = memory.queue_new_clusters::<FETCH>(&located);
        for first in (0..new.count).step_by(8) {
            // SAFETY: as for this function.
            let found = unsafe { r.tables.search::<FETCH>(load(&memory.queue, first)) };
            store(&mut memory.results.0, first, found.present);
            store(&mut memory.results.1, first, found.masks);
        }
        let (mut taken, mut before) = (0, memory.found[EIGHTS - 1]);
        for i in 0..EIGHTS {
            let (heads, sought) = ((new.heads >> (8 * i)) as u8, (new.sought >> (8 * i)) as u8);
            let known = memory.found[i];
            let of_head = Found {
                present: _mm512_mask_expand_epi64(known.present, sought, load(&memory.results.0, taken)),
                masks: _mm512_mask_expand_epi64(known.masks, sought, load(&memory.results.1, taken)),
            };
            taken += sought.count_ones() as usize;
            let latest = latest_of(heads);
            before = Found {
                present: _mm512_permutex2var_epi64(of_head.present, latest, before.present),
                masks: _mm512_permutex2var_epi64(of_head.masks, latest, before.masks),
            };
            memory.found[i] = before;
            word.cells[i] = located[i / 2].cells[i % 2];
            word.words[i] = before.words(word.cells[i]);
            if FETCH {
                prefetch_now(word.words[i]);
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn answer(r: &ExactRegisters<'_>, _: &mut ExactMemory, word: &ExactWord) -> u64 {
        let mut hits = 0;
        for (i, (&words, &cells)) in word.words.iter().zip(&word.cells).enumerate() {
            // SAFETY: each address is of a word of a mask that the view keeps alive, or of `ABSENT`.
            let words = unsafe { gather_now(words) };
            hits |= u64::from(_mm512_test_epi64_mask(words, within(cells, r.up))) << (8 * i);
        }
        hits
    }
}

/// The voxels of a word whose clusters are not known yet.
struct New {
    /// A bit for each in another cluster than the lane before it.
    heads: u64,
    /// Those of them that are sought, since they lie in another cluster than the same lane of the word before.
    sought: u64,
    /// The number of these.
    count: usize,
}

impl ExactMemory {
    /// Finds and queues the clusters that are not known yet. Each probe has one of its own: it has one caller.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn queue_new_clusters<const FETCH: bool>(&mut self, located: &[Located; GROUPS]) -> New {
        let (mut new, mut before) = (New { heads: 0, sought: 0, count: 0 }, self.clusters[EIGHTS - 1]);
        for i in 0..EIGHTS {
            let clusters = located[i / 2].clusters[i % 2];
            let heads = _mm512_cmpneq_epi64_mask(clusters, _mm512_alignr_epi64::<7>(clusters, before));
            let sought = heads & _mm512_cmpneq_epi64_mask(clusters, self.clusters[i]);
            new.heads |= u64::from(heads) << (8 * i);
            new.sought |= u64::from(sought) << (8 * i);
            store(&mut self.queue, new.count, _mm512_maskz_compress_epi64(sought, clusters));
            new.count += sought.count_ones() as usize;
            self.clusters[i] = clusters;
            before = clusters;
        }
        new
    }
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

/// The SIMD variant of [`Cell::of`] and `BlockInCluster::of`, for sixteen indices: numbers of cells within clusters.
///
/// ```text
/// | place of the block (6 bits) | cell (9 bits) |
/// ```
#[inline]
#[target_feature(enable = "avx512f")]
fn cell(index: [__m512i; 3]) -> __m512i {
    // The permutation looks at five bits of an index: three of the cell, two of the place.
    const SPREAD: [[[i32; LANES]; 2]; 3] = {
        let mut spread = [[[0; LANES]; 2]; 3];
        let mut i = 0;
        while i < 3 * 2 * LANES {
            let (axis, index) = (i / (2 * LANES), i % (2 * LANES));
            let cell = (Cell::SPREAD >> ((index & 7) * 8)) as i32 & 0xff;
            let place = (index >> BLOCK_LEVELS) as i32;
            spread[axis][index / LANES][index % LANES] =
                cell << axis | place << (CELL_BITS + CLUSTER_LEVELS * axis as u32);
            i += 1;
        }
        spread
    };
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let [low, high] = &SPREAD[axis];
        _mm512_permutex2var_epi32(lanes(low), index[axis], lanes(high))
    });
    _mm512_or_si512(_mm512_or_si512(x, y), z)
}

/// The SIMD variant of `BlockMask::within`.
#[inline]
#[target_feature(enable = "avx512f")]
fn within(cell: __m512i, up: u32) -> __m512i {
    match up {
        0 => _mm512_sllv_epi64(_mm512_set1_epi64(1), _mm512_and_si512(cell, _mm512_set1_epi64(63))),
        1 => _mm512_sllv_epi64(_mm512_set1_epi64(0xff), _mm512_and_si512(cell, _mm512_set1_epi64(0b11_1000))),
        _ => _mm512_set1_epi64(-1),
    }
}
