//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::kernel::{BATCH, Batch, LookupKernel};
use super::registers::{mix, of_shards, pack, prefetch, scale, store};
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::SHARDS;
use crate::voxel::quantize::avx2::LANES;
use crate::voxel::{BLOCK_LEVELS, BUCKET, BlockMask, Bucket, CLUSTER_LEVELS, Cell, Cluster, Slots};

/// The tables: addresses of keys, and buckets, of each shard's.
pub(super) struct Tables<'a> {
    view: &'a LevelView<'a>,
    keys: [u64; SHARDS],
    buckets: [u64; SHARDS],
}

impl<'a> Tables<'a> {
    pub(super) fn of(view: &'a LevelView<'_>) -> Self {
        Self {
            view,
            keys: view.blocks.map(|slots| slots.keys.as_ptr().expose_provenance() as u64),
            buckets: view.blocks.map(|slots| slots.keys.len() as u64),
        }
    }
}

/// What a cluster that is not there begins with.
static NO_CLUSTER: [u64; 2] = [0; 2];
/// The mask of a block that is not there.
static ABSENT: BlockMask = BlockMask::EMPTY;

impl LookupKernel for Tables<'_> {
    #[target_feature(enable = "avx2")]
    unsafe fn look_up(&self, batch: &Batch, points: usize) -> [u64; BATCH / 64] {
        let (clusters, cells) = split(&batch.index, self.view.up);
        let (mut keys, mut buckets) = ([0u64; BATCH], [0u64; BATCH]);
        for at in (0..points.next_multiple_of(4)).step_by(4) {
            let key = pack(&clusters, at);
            let bucket =
                scale(mix(key, Slots::HASH_A, Slots::HASH_B), of_shards(&self.buckets, &batch.shard, at));
            let table = of_shards(&self.keys, &batch.shard, at);
            store(&mut keys[at..], key);
            store(&mut buckets[at..], bucket);
            let mut addresses = [0; 4];
            store(&mut addresses, _mm256_add_epi64(table, _mm256_slli_epi64::<6>(bucket)));
            addresses.into_iter().for_each(prefetch);
        }
        let mut found = [(&raw const NO_CLUSTER).expose_provenance() as u64; BATCH];
        for i in 0..points {
            let slots = self.view.blocks[batch.shard[i] as usize];
            if let Some(slot) = find(slots, keys[i], buckets[i] as usize) {
                found[i] = (&raw const slots.clusters[slot]).expose_provenance() as u64;
                prefetch(found[i]);
            }
        }
        let mut words = [0; BATCH];
        for at in (0..points).step_by(4) {
            // SAFETY: each address is of a cluster that the view keeps alive, or of `NO_CLUSTER`.
            let [present, masks] = unsafe { pairs(&found[at..at + 4]) };
            store(&mut words[at..], word(present, masks, four(&cells, at)));
            words[at..at + 4].iter().for_each(|&address| prefetch(address));
        }
        let mut hits = [0; BATCH / 64];
        for at in (0..points).step_by(4) {
            // SAFETY: four u64 are one register; each address is of a word of a mask that the view keeps alive, or of
            // `ABSENT`.
            let words = unsafe {
                let address = _mm256_loadu_si256(words[at..at + 4].as_ptr().cast());
                _mm256_i64gather_epi64::<1>(std::ptr::null(), address)
            };
            let within = within(four(&cells, at), self.view.up);
            let free = _mm256_cmpeq_epi64(_mm256_and_si256(words, within), _mm256_setzero_si256());
            hits[at / 64] |= (!_mm256_movemask_pd(_mm256_castsi256_pd(free)) as u64 & 0xf) << (at % 64);
        }
        hits
    }
}

/// The first two u64 at each of four addresses.
///
/// # Safety
/// Needs AVX2; each address must be of two u64 that may be read.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn pairs(addresses: &[u64]) -> [__m256i; 2] {
    let pair = |i: usize| {
        // SAFETY: as for this function.
        unsafe { _mm_loadu_si128(std::ptr::with_exposed_provenance(addresses[i] as usize)) }
    };
    let (low, high) = (_mm256_set_m128i(pair(2), pair(0)), _mm256_set_m128i(pair(3), pair(1)));
    [_mm256_unpacklo_epi64(low, high), _mm256_unpackhi_epi64(low, high)]
}

/// Four cells, from `at` on.
#[inline]
#[target_feature(enable = "avx2")]
fn four(cells: &[i32; BATCH], at: usize) -> __m256i {
    // SAFETY: four i32 are half a register.
    unsafe { _mm256_cvtepu32_epi64(_mm_loadu_si128(cells[at..at + 4].as_ptr().cast())) }
}

/// Addresses of the words of masks that hold four cells of clusters: the SIMD variant of `Cluster::get`.
#[inline]
#[target_feature(enable = "avx2")]
fn word(present: __m256i, masks: __m256i, cells: __m256i) -> __m256i {
    let one = _mm256_set1_epi64x(1);
    let bit = _mm256_sllv_epi64(one, _mm256_srli_epi64::<{ CELL_BITS as i32 }>(cells));
    let before = _mm256_and_si256(present, _mm256_sub_epi64(bit, one));
    let mask = _mm256_add_epi64(masks, _mm256_slli_epi64::<6>(ones(before)));
    let word = _mm256_and_si256(_mm256_srli_epi64::<3>(cells), _mm256_set1_epi64x(0b111 << 3));
    let there = _mm256_cmpeq_epi64(_mm256_and_si256(present, bit), bit);
    let absent = _mm256_set1_epi64x((&raw const ABSENT).expose_provenance() as i64);
    _mm256_blendv_epi8(absent, _mm256_add_epi64(mask, word), there)
}

/// The number of ones in each lane.
#[inline]
#[target_feature(enable = "avx2")]
fn ones(words: __m256i) -> __m256i {
    let low = _mm256_set1_epi8(0xf);
    let of_nibble =
        _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
    let of_low = _mm256_shuffle_epi8(of_nibble, _mm256_and_si256(words, low));
    let of_high = _mm256_shuffle_epi8(of_nibble, _mm256_and_si256(_mm256_srli_epi64::<4>(words), low));
    _mm256_sad_epu8(_mm256_add_epi8(of_low, of_high), _mm256_setzero_si256())
}

const _: () = assert!(
    size_of::<Bucket>() == 64
        && size_of::<BlockMask>() == 64
        && std::mem::offset_of!(Cluster, present) == 0
        && std::mem::offset_of!(Cluster, first_mask) == 8,
    "as what is above takes them"
);

/// The slot of `key`, whose home is `bucket`.
#[inline]
#[target_feature(enable = "avx2")]
fn find(slots: Slots<'_>, key: u64, bucket: usize) -> Option<usize> {
    let keys = &slots.keys[bucket].0;
    let wanted = _mm256_set1_epi64x(key as i64);
    let half = |i: usize| {
        // SAFETY: half a bucket is four u64, one register.
        let keys = unsafe { _mm256_loadu_si256(keys[i..i + 4].as_ptr().cast()) };
        _mm256_movemask_pd(_mm256_castsi256_pd(_mm256_cmpeq_epi64(keys, wanted)))
    };
    match half(0) | half(4) << 4 {
        0 if Slots::is_full(keys) => slots.find(key),
        0 => None,
        equal => Some(bucket * BUCKET + equal.trailing_zeros() as usize),
    }
}

/// Bits of a cell's number in its block, behind which that of the block in its cluster begins.
const CELL_BITS: u32 = 3 * BLOCK_LEVELS;

/// The SIMD variant of [`Cell::of`] and `BlockInCluster::of`: cluster indices, and numbers of cells within clusters, of
/// the voxels of a level `up` levels up in its blocks.
#[inline]
#[target_feature(enable = "avx2")]
fn split(index: &[[i32; BATCH]; 3], up: u32) -> ([[i32; BATCH]; 3], [i32; BATCH]) {
    let spread = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| (Cell::SPREAD >> (i * 8)) as i32 & 0xff);
    let to_finest = _mm_cvtsi32_si128(up as i32);
    let to_cluster = _mm_cvtsi32_si128((BLOCK_LEVELS + CLUSTER_LEVELS - up) as i32);
    let of_place = _mm256_set1_epi32(((1 << CLUSTER_LEVELS) - 1) << BLOCK_LEVELS);
    let (mut clusters, mut cells) = ([[0; BATCH]; 3], [0; BATCH]);
    for at in (0..BATCH).step_by(LANES) {
        let mut cell = _mm256_setzero_si256();
        for axis in 0..3 {
            // SAFETY: eight i32 are one register, each time.
            unsafe {
                let i = _mm256_loadu_si256(index[axis][at..at + LANES].as_ptr().cast());
                let cluster = clusters[axis][at..at + LANES].as_mut_ptr().cast();
                _mm256_storeu_si256(cluster, _mm256_sra_epi32(i, to_cluster));
                let table = _mm256_loadu_si256(spread.as_ptr().cast());
                let finest = _mm256_sll_epi32(i, to_finest);
                // The permutation looks at three bits of an index.
                let bits = _mm256_permutevar8x32_epi32(table, finest);
                let place = _mm256_sll_epi32(
                    _mm256_and_si256(finest, of_place),
                    _mm_cvtsi32_si128((CELL_BITS - BLOCK_LEVELS + CLUSTER_LEVELS * axis as u32) as i32),
                );
                let bits = _mm256_sll_epi32(bits, _mm_cvtsi32_si128(axis as i32));
                cell = _mm256_or_si256(cell, _mm256_or_si256(bits, place));
            }
        }
        // SAFETY: eight i32 are one register.
        unsafe { _mm256_storeu_si256(cells[at..at + LANES].as_mut_ptr().cast(), cell) };
    }
    (clusters, cells)
}

/// The SIMD variant of `BlockMask::within`.
#[inline]
#[target_feature(enable = "avx2")]
fn within(cells: __m256i, up: u32) -> __m256i {
    let part = |part: i64| _mm256_and_si256(cells, _mm256_set1_epi64x(part));
    match up {
        0 => _mm256_sllv_epi64(_mm256_set1_epi64x(1), part(63)),
        1 => _mm256_sllv_epi64(_mm256_set1_epi64x(0xff), part(0b11_1000)),
        _ => _mm256_set1_epi64x(-1),
    }
}
