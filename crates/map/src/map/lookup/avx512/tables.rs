//! Clusters of blocks, sought in their shards' tables eight at a time.

use std::arch::x86_64::*;

use super::registers::{PerShard, addresses, gather_now, gather_pairs, lengths, load, mix, scale, to_array};
use crate::map::lookup::level_view::LevelView;
use crate::voxel::quantize::avx512::LANES;
use crate::voxel::{BLOCK_LEVELS, BlockMask, Bucket, CLUSTER_LEVELS, CacheLine, Cluster, Slots};

/// Descriptors of the shards' tables, which stay in registers.
pub(super) struct Tables<'a> {
    view: &'a LevelView<'a>,
    tags: PerShard,
    keys: PerShard,
    clusters: PerShard,
    buckets: PerShard,
}

/// Eight clusters.
#[derive(Clone, Copy)]
pub(super) struct Found {
    /// The blocks that are there.
    pub(super) present: __m512i,
    /// Addresses of the first of their masks.
    pub(super) masks: __m512i,
}

/// The mask of a block that is not there.
static ABSENT: CacheLine<BlockMask> = CacheLine(BlockMask::EMPTY);

impl<'a> Tables<'a> {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(view: &'a LevelView<'_>) -> Self {
        Self {
            view,
            tags: PerShard::load(addresses(view.blocks.map(|slots| slots.tags))),
            keys: PerShard::load(addresses(view.blocks.map(|slots| slots.keys))),
            clusters: PerShard::load(addresses(view.blocks.map(|slots| slots.clusters))),
            buckets: PerShard::load(lengths(view.blocks.map(|slots| slots.keys))),
        }
    }

    /// Finds clusters in their shards' tables. Each probe has one of its own: it has one caller.
    ///
    /// A bucket's tags say which slot may hold a cluster, and so where its key is, which decides.
    ///
    /// # Safety
    /// Needs AVX-512 F, BW, DQ and CD; the view must still live.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    pub(super) unsafe fn search<const FETCH: bool>(&self, clusters: __m512i) -> Found {
        let (keys, shards) = of_shard(clusters);
        let h = mix(keys, Slots::HASH_A, Slots::HASH_B);
        let bucket = scale(h, self.buckets.of(shards));
        let tags_address = _mm512_add_epi64(self.tags.of(shards), _mm512_slli_epi64::<3>(bucket));
        // SAFETY: the address is of a bucket's tags of a shard's table, which the view keeps alive.
        let tags = unsafe { gather_now(tags_address) };
        // The place of the first tag that fits, times eight: each takes a byte, as a key does a u64.
        let fits = fitting(tags, h);
        let first = _mm512_sub_epi64(_mm512_set1_epi64(63), _mm512_lzcnt_epi64(fits));
        let place = _mm512_and_si512(first, _mm512_set1_epi64(!7));
        let tagged = _mm512_test_epi64_mask(fits, fits);
        let slot = _mm512_add_epi64(_mm512_slli_epi64::<6>(bucket), place);
        let key = _mm512_add_epi64(self.keys.of(shards), slot);
        let cluster = _mm512_add_epi64(self.clusters.of(shards), _mm512_slli_epi64::<2>(slot));
        let [key, cluster] = [key, cluster].map(|address| _mm512_mask_mov_epi64(absent(), tagged, address));
        // SAFETY: each address is of a key that the view keeps alive and of its cluster, or of `ABSENT`.
        let (is_key, [present, masks]) = unsafe { (gather_now(key), gather_pairs(cluster)) };
        let found = tagged & _mm512_cmpeq_epi64_mask(is_key, keys);
        let result = Found { present: _mm512_maskz_mov_epi64(found, present), masks };
        let full = _mm512_test_epi64_mask(tags, _mm512_set1_epi64(0xff << 56));
        let elsewhere = !found & (tagged | full);
        if elsewhere == 0 { result } else { self.elsewhere(keys, shards, result, elsewhere) }
    }

    /// Finds those that are not in the first slots whose tags fit as well.
    #[cold]
    #[target_feature(enable = "avx512f")]
    fn elsewhere(&self, keys: __m512i, shards: __m512i, found: Found, elsewhere: u8) -> Found {
        let [keys, shards, mut present, mut masks] =
            [keys, shards, found.present, found.masks].map(|lanes| to_array(lanes));
        for lane in (0..8).filter(|lane| elsewhere >> lane & 1 == 1) {
            let slots = self.view.blocks[shards[lane] as usize];
            if let Some(slot) = slots.find(keys[lane]) {
                let cluster = &slots.clusters[slot];
                (present[lane], masks[lane]) = (cluster.present, cluster.first_mask as u64);
            }
        }
        Found { present: load(&present, 0), masks: load(&masks, 0) }
    }
}

impl Found {
    /// Addresses of the words of masks that hold `cells` of these clusters: the SIMD variant of `Cluster::get`.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw")]
    pub(super) fn words(&self, cells: __m512i) -> __m512i {
        let place = _mm512_srli_epi64::<{ CELL_BITS }>(cells);
        let bit = _mm512_sllv_epi64(_mm512_set1_epi64(1), place);
        let there = _mm512_test_epi64_mask(self.present, bit);
        let before = _mm512_and_si512(self.present, _mm512_sub_epi64(bit, _mm512_set1_epi64(1)));
        let mask = _mm512_add_epi64(self.masks, _mm512_slli_epi64::<6>(ones(before)));
        let word = _mm512_and_si512(_mm512_srli_epi64::<3>(cells), _mm512_set1_epi64(0b111 << 3));
        _mm512_mask_mov_epi64(absent(), there, _mm512_add_epi64(mask, word))
    }
}

/// Bits of a cell's number in its block, behind which that of the block in its cluster begins.
pub(super) const CELL_BITS: u32 = 3 * BLOCK_LEVELS;

const _: () = assert!(
    size_of::<Bucket>() == 64
        && size_of::<CacheLine<BlockMask>>() == 64
        && size_of::<Cluster>() == 32
        && std::mem::offset_of!(Cluster, present) == 0
        && std::mem::offset_of!(Cluster, first_mask) == 8,
    "as what is above takes them"
);

#[inline]
#[target_feature(enable = "avx512f")]
fn absent() -> __m512i {
    _mm512_set1_epi64((&raw const ABSENT).expose_provenance() as i64)
}

/// Keys of clusters and their shards in one: a cluster of coarse voxels is larger than a region, and each of several
/// shards has a part of it.
///
/// The shard goes where a cluster's key only repeats the sign of z, since its indices have five bits fewer than a
/// voxel's.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn within_shard(keys: __m512i, shards: __m512i) -> __m512i {
    _mm512_xor_si512(keys, _mm512_slli_epi64::<SHARD_SHIFT>(shards))
}

/// The inverse of [`within_shard`].
#[inline]
#[target_feature(enable = "avx512f")]
fn of_shard(clusters: __m512i) -> (__m512i, __m512i) {
    // The highest bit that tells z apart, which is its sign, everywhere.
    let sign = _mm512_srai_epi64::<63>(_mm512_slli_epi64::<{ 64 - SHARD_SHIFT }>(clusters));
    let marks = _mm512_xor_si512(_mm512_srli_epi64::<SHARD_SHIFT>(clusters), sign);
    let shards = _mm512_and_si512(marks, _mm512_set1_epi64(LANES as i64 - 1));
    (within_shard(clusters, shards), shards)
}

const SHARD_SHIFT: u32 = 58;
const _: () = assert!(
    LANES << SHARD_SHIFT <= 1 << 62 && BLOCK_LEVELS + CLUSTER_LEVELS >= 5,
    "below the sign of z, which is bit 62, and above the rest of it"
);

/// The number of ones in each lane.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn ones(words: __m512i) -> __m512i {
    let low = _mm512_set1_epi8(0xf);
    let of_nibble = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
    let of_low = _mm512_shuffle_epi8(of_nibble, _mm512_and_si512(words, low));
    let of_high = _mm512_shuffle_epi8(of_nibble, _mm512_and_si512(_mm512_srli_epi64::<4>(words), low));
    _mm512_sad_epu8(_mm512_add_epi8(of_low, of_high), _mm512_setzero_si512())
}

/// The top bit of each byte of `tags` that is the tag of a key with hash `h`; of bytes beyond the first such, it may be
/// set without reason. The SIMD variant of `Slots::tag`.
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
