//! The slots of a table of clusters, as the look-ups read them: homes, tags and the search for a key.

use super::block::BlockMask;
use super::cluster::{BlockInCluster, CacheLine, Cluster};
use super::key::VoxelKey;

/// Marks a vacant slot; no key sets bit 63.
pub(super) const VACANT: u64 = u64::MAX;
/// Slots of a bucket: eight keys are one cache line.
pub(crate) const BUCKET: usize = 8;
/// The keys of one bucket: those in use first.
pub(crate) type Bucket = CacheLine<[u64; BUCKET]>;
pub(super) const VACANT_BUCKET: Bucket = CacheLine([VACANT; BUCKET]);

/// A byte of a key for each slot of a bucket, none of them zero; zero where the slot is vacant.
pub(crate) type Tags = u64;

/// A table's slots as plain slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slots<'a> {
    #[cfg(target_arch = "x86_64")]
    pub(crate) tags: &'a [Tags],
    pub(crate) keys: &'a [Bucket],
    pub(crate) clusters: &'a [Cluster],
    /// Bytes of all masks.
    #[cfg(target_arch = "x86_64")]
    pub(crate) mask_bytes: usize,
}

impl Slots<'static> {
    /// The slots of a table without a block: there is no cluster where no key is.
    pub(crate) const NONE: Self = Self {
        #[cfg(target_arch = "x86_64")]
        tags: &[0],
        keys: &[VACANT_BUCKET],
        clusters: &[],
        #[cfg(target_arch = "x86_64")]
        mask_bytes: 0,
    };
}

impl<'a> Slots<'a> {
    pub(crate) const HASH_A: u64 = 0x9e37_79b9_7f4a_7c15;
    pub(crate) const HASH_B: u64 = 0xd6e8_feb8_6659_fd93;
    /// Where a tag's bits lie in the hash.
    pub(crate) const TAG_SHIFT: u32 = 24;

    /// The bucket where the search for `key` starts among `buckets` buckets.
    ///
    /// ```text
    /// home = high32(hash) * buckets >> 32,   hash = (k * A ^ (k * A) >> 32) * B
    /// ```
    #[inline(always)]
    pub(crate) fn home(key: u64, buckets: usize) -> usize {
        (((Self::hash(key) >> 32) * buckets as u64) >> 32) as usize
    }

    #[inline(always)]
    fn hash(key: u64) -> u64 {
        let h = key.wrapping_mul(Self::HASH_A);
        (h ^ h >> 32).wrapping_mul(Self::HASH_B)
    }

    /// The tag of a key: eight bits of its hash that the home does not depend on, or 1 where they are zero.
    #[inline(always)]
    pub(super) fn tag(key: u64) -> Tags {
        (Self::hash(key) >> Self::TAG_SHIFT & 0xff).max(1)
    }

    /// True when a search must go on past the bucket: its vacant slots come last.
    #[inline(always)]
    pub(crate) fn is_full(bucket: &[u64; BUCKET]) -> bool {
        bucket[BUCKET - 1] != VACANT
    }

    /// The clusters with their keys, in no order.
    pub(crate) fn iter(self) -> impl Iterator<Item = (VoxelKey, &'a Cluster)> {
        let keys = self.keys.iter().flat_map(|bucket| bucket.0);
        keys.zip(self.clusters).filter_map(|(key, cluster)| Some((VoxelKey::from_bits(key)?, cluster)))
    }

    /// The slot of `key`.
    #[inline(always)]
    pub(crate) fn find(self, key: u64) -> Option<usize> {
        let mut bucket = Self::home(key, self.keys.len());
        loop {
            let keys = &self.keys[bucket].0;
            // All eight compared at once: this compiles to vector instructions, a search that stops would not.
            let equal = (0..BUCKET).fold(0u32, |equal, i| equal | u32::from(keys[i] == key) << i);
            if equal != 0 {
                return Some(bucket * BUCKET + equal.trailing_zeros() as usize);
            }
            if !Self::is_full(keys) {
                return None;
            }
            bucket = if bucket + 1 == self.keys.len() { 0 } else { bucket + 1 };
        }
    }

    /// The voxels of `block`; none of them when the block is absent.
    #[inline(always)]
    pub(crate) fn get(self, block: VoxelKey) -> &'a BlockMask {
        let (cluster, place) = BlockInCluster::of(block);
        match self.find(cluster.to_bits()) {
            Some(slot) => self.clusters[slot].get(place),
            None => &BlockMask::EMPTY,
        }
    }
}
