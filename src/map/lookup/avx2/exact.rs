//! The probe of the table of blocks.

use std::arch::x86_64::*;

use super::{BATCH, Batch, LANES, Probe, mix, of_shards, pack, prefetch, scale, store};
use crate::map::lookup::LevelView;
use crate::map::sharding::SHARDS;
use crate::voxel::{BLOCK_LEVELS, BUCKET, BlockMask, Bucket, CLUSTER_LEVELS, Cell, Place, Slots};

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

impl Probe for Tables<'_> {
    #[target_feature(enable = "avx2,popcnt")]
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
        let mut found = [None; BATCH];
        for i in 0..points {
            let slots = self.view.blocks[batch.shard[i] as usize];
            if let Some(slot) = find(slots, keys[i], buckets[i] as usize) {
                let cluster = &slots.clusters[slot];
                prefetch((&raw const *cluster).expose_provenance() as u64);
                found[i] = Some(cluster);
            }
        }
        let mut masks = [&BlockMask::EMPTY; BATCH];
        for i in 0..points {
            if let Some(cluster) = found[i] {
                masks[i] = cluster.get(Place::from_bits(cells[i] as u32 >> CELL_BITS));
                prefetch((&raw const masks[i].0[word(cells[i])]).expose_provenance() as u64);
            }
        }
        let mut hits = [0; BATCH / 64];
        for i in 0..points {
            let hit = masks[i].0[word(cells[i])] & within(cells[i], self.view.up) != 0;
            hits[i / 64] |= u64::from(hit) << (i % 64);
        }
        hits
    }
}

const _: () = assert!(size_of::<Bucket>() == 64, "as the shift above takes it");

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

/// The twin of [`Cell::of`] and [`Place::of`]: cluster indices, and numbers of cells within clusters, of the voxels of a
/// level `up` levels up in its blocks.
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

/// The word of its block's mask that holds a cell.
#[inline(always)]
fn word(cell: i32) -> usize {
    cell as usize >> 6 & 7
}

/// The twin of `BlockMask::within`.
#[inline(always)]
fn within(cell: i32, up: u32) -> u64 {
    match up {
        0 => 1 << (cell & 63),
        1 => 0xff << (cell & 0b11_1000),
        _ => u64::MAX,
    }
}
