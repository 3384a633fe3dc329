//! An exact set of voxels as an open-addressed table of clusters of blocks.

use super::block::{BlockMask, Cell};
use super::cluster::Cluster;
use super::key::VoxelKey;
use super::slots::{BUCKET, Bucket, Slots, Tags, VACANT, VACANT_BUCKET};

/// Slots for each cluster, at least. At 3 one bucket in 150 is full (a Poisson tail), so that nearly every search ends
/// in the bucket where it began; a wide look-up leaves its way if one of eight does not. At 2 it was one in twenty, and
/// small maps took an eighth to a third longer at random.
const SLOTS_A_CLUSTER: usize = 3;

/// Blocks by key, by way of their clusters, which are in buckets of eight.
///
/// ```text
/// tags      [ 8 x 8 bits | ... ]           which slots of a bucket may hold a key
/// keys      [ 8 keys | 8 keys | ... ]      a cache line a bucket; a search reads one, seldom two
/// clusters  [ 8 x 32 bytes | ... ]         the cluster of keys[b][i] is clusters[8 b + i]; its masks are elsewhere
/// ```
///
/// There is a cluster for some fifteen blocks, or a thousand voxels, of a surface: so all of this but the masks fits in
/// the caches, and a block costs a look-up one miss.
///
/// A key lives in its home bucket or, where that is full, in the next one that is not. A bucket's vacant slots
/// come last, so that its last key tells whether a search has to go on; removal pulls keys back instead of
/// leaving tombstones. Any number of buckets is allowed (the home is a multiply-shift of the hash, not a
/// remainder), so that a table grows in small steps.
#[derive(Debug)]
pub struct ClusterTable {
    tags: Vec<Tags>,
    keys: Vec<Bucket>,
    clusters: Vec<Cluster>,
    /// Clusters in use, blocks in them, and bytes of their masks.
    used: usize,
    blocks: usize,
    mask_bytes: usize,
}

impl Default for ClusterTable {
    /// A table without a block. It has a bucket, so that a search has where to begin, and no clusters: they come with
    /// the first key.
    fn default() -> Self {
        Self {
            tags: vec![0; 1],
            keys: vec![VACANT_BUCKET; 1],
            clusters: Vec::new(),
            used: 0,
            blocks: 0,
            mask_bytes: 0,
        }
    }
}

impl ClusterTable {
    fn with_room_for(clusters: usize) -> Self {
        // One slot more than the load allows for, so that a search always meets a bucket that is not full.
        let buckets = (clusters * SLOTS_A_CLUSTER + 1).div_ceil(BUCKET);
        Self {
            tags: vec![0; buckets],
            keys: vec![VACANT_BUCKET; buckets],
            clusters: vacant(buckets),
            used: 0,
            blocks: 0,
            mask_bytes: 0,
        }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.blocks
    }

    /// True without a block.
    pub fn is_empty(&self) -> bool {
        self.blocks == 0
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        let slots =
            size_of_val(&self.tags[..]) + size_of_val(&self.keys[..]) + size_of_val(&self.clusters[..]);
        slots + self.mask_bytes
    }

    /// What the look-up kernels read.
    pub(crate) fn slots(&self) -> Slots<'_> {
        Slots {
            #[cfg(target_arch = "x86_64")]
            tags: &self.tags,
            keys: &self.keys,
            clusters: &self.clusters,
            #[cfg(target_arch = "x86_64")]
            mask_bytes: self.mask_bytes,
        }
    }

    /// The voxels of `block`; none of them when the block is absent.
    #[inline]
    pub fn get(&self, block: VoxelKey) -> &BlockMask {
        self.slots().get(block)
    }

    /// True when the voxel at `index`, or at `level` (0, 1 or 2) its ancestor, is occupied.
    #[inline]
    pub fn contains(&self, index: [i32; 3], level: u32) -> bool {
        let (block, cell) = Cell::of(index.map(|i| i << level));
        self.get(block).contains(cell, level)
    }

    /// The keys among which the search for a cluster begins.
    #[inline]
    pub(crate) fn home(&self, cluster: VoxelKey) -> &Bucket {
        &self.keys[Slots::home(cluster.to_bits(), self.keys.len())]
    }

    /// The cluster with this key.
    #[inline]
    pub(crate) fn cluster(&self, key: VoxelKey) -> Option<&Cluster> {
        self.slots().find(key.to_bits()).map(|slot| &self.clusters[slot])
    }

    /// Replaces a cluster; one without a block goes.
    pub(crate) fn set_cluster(&mut self, key: VoxelKey, cluster: Cluster) {
        let key = key.to_bits();
        let (blocks, bytes) = (cluster.len(), cluster.bytes());
        let before = match (self.slots().find(key), blocks) {
            (Some(slot), 0) => self.remove(slot),
            (Some(slot), _) => std::mem::replace(&mut self.clusters[slot], cluster),
            (None, 0) => cluster,
            (None, _) => {
                let slot = self.add(key);
                std::mem::replace(&mut self.clusters[slot], cluster)
            }
        };
        self.blocks = self.blocks - before.len() + blocks;
        self.mask_bytes = self.mask_bytes - before.bytes() + bytes;
    }

    /// The slot of a key that was absent.
    fn add(&mut self, key: u64) -> usize {
        // One slot stays vacant.
        if self.used * SLOTS_A_CLUSTER + SLOTS_A_CLUSTER >= self.clusters.len() {
            self.grow();
        }
        self.add_in_room(key)
    }

    /// Adds a cluster where there is a vacant slot.
    fn add_in_room(&mut self, key: u64) -> usize {
        self.used += 1;
        let mut bucket = Slots::home(key, self.keys.len());
        loop {
            if let Some(place) = self.keys[bucket].0.iter().position(|&k| k == VACANT) {
                let slot = bucket * BUCKET + place;
                self.set_key(slot, key);
                return slot;
            }
            bucket = self.after(bucket);
        }
    }

    /// Moves to a larger table. Masks stay where they are, and there are few clusters: this is done while readers wait.
    fn grow(&mut self) {
        let larger = Self::with_room_for(match self.clusters.is_empty() {
            true => 0,
            false => self.used * 5 / 4 + 4,
        });
        let Self { keys, clusters, blocks, mask_bytes, .. } = std::mem::replace(self, larger);
        let keys = keys.iter().flat_map(|bucket| bucket.0);
        for (key, cluster) in keys.zip(clusters).filter(|(key, _)| *key != VACANT) {
            let slot = self.add_in_room(key);
            self.clusters[slot] = cluster;
        }
        (self.blocks, self.mask_bytes) = (blocks, mask_bytes);
    }

    fn after(&self, bucket: usize) -> usize {
        if bucket + 1 == self.keys.len() { 0 } else { bucket + 1 }
    }

    /// Takes out the cluster at `slot`.
    fn remove(&mut self, slot: usize) -> Cluster {
        self.used -= 1;
        let removed = std::mem::take(&mut self.clusters[slot]);
        self.vacate(slot);
        removed
    }

    /// Empties `slot`, and where that makes room in a full bucket, pulls back a key that had to go past it.
    fn vacate(&mut self, slot: usize) {
        let (bucket, was_full) = (slot / BUCKET, self.keys[slot / BUCKET].0[BUCKET - 1] != VACANT);
        let last = (0..BUCKET).rev().find(|&i| self.keys[bucket].0[i] != VACANT).unwrap_or_default();
        self.relocate(bucket * BUCKET + last, slot);
        if was_full && let Some(displaced) = self.displaced_past(bucket) {
            let place = bucket * BUCKET + BUCKET - 1;
            self.set_key(place, self.keys[displaced / BUCKET].0[displaced % BUCKET]);
            self.clusters[place] = std::mem::take(&mut self.clusters[displaced]);
            self.vacate(displaced);
        }
    }

    /// Moves a key and its cluster; `from` is vacant afterwards.
    fn relocate(&mut self, from: usize, to: usize) {
        self.set_key(to, self.keys[from / BUCKET].0[from % BUCKET]);
        self.clusters.swap(from, to);
        self.set_key(from, VACANT);
        self.clusters[from] = Cluster::default();
    }

    fn set_key(&mut self, slot: usize, key: u64) {
        let (bucket, place) = (slot / BUCKET, slot % BUCKET);
        self.keys[bucket].0[place] = key;
        let tag = if key == VACANT { 0 } else { Slots::tag(key) };
        let shift = place * 8;
        self.tags[bucket] = self.tags[bucket] & !(0xff << shift) | tag << shift;
    }

    /// The first slot beyond `bucket` whose key would rather live in it, or before it.
    fn displaced_past(&self, bucket: usize) -> Option<usize> {
        let buckets = self.keys.len();
        let distance = |from: usize, to: usize| (to + buckets - from) % buckets;
        let mut at = self.after(bucket);
        while at != bucket {
            let passed =
                |key: u64| key != VACANT && distance(Slots::home(key, buckets), at) >= distance(bucket, at);
            if let Some(place) = self.keys[at].0.iter().position(|&key| passed(key)) {
                return Some(at * BUCKET + place);
            }
            if self.keys[at].0[BUCKET - 1] == VACANT {
                return None;
            }
            at = self.after(at);
        }
        None
    }

    /// All blocks, in no order.
    pub fn iter(&self) -> impl Iterator<Item = (VoxelKey, &BlockMask)> {
        self.slots().iter().flat_map(|(key, cluster)| cluster.blocks(key))
    }
}

fn vacant(buckets: usize) -> Vec<Cluster> {
    std::iter::repeat_with(Cluster::default).take(buckets * BUCKET).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::util::StopSignal;
    use crate::voxel::cluster::BlockInCluster;
    use crate::voxel::cluster_update::ClusterUpdate;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// A cluster of one block, which has one voxel.
    fn cluster(key: VoxelKey, cell: u16) -> Cluster {
        let mut mask = BlockMask::EMPTY;
        mask.insert(Cell::from_bits(cell));
        let (_, place) = BlockInCluster::of(key.first_within(2));
        let mut cluster = Cluster::default().with_blocks(place.bit());
        cluster.set(place, mask);
        cluster
    }

    proptest! {
        #[test]
        fn a_table_holds_what_was_set_last(
            changes in prop::collection::vec(prop::collection::btree_map((0i32..60, -2i32..2), 0u16..3, 1..20), 0..40),
        ) {
            let mut table = ClusterTable::default();
            let mut model = BTreeMap::new();
            for change in changes {
                let mut blocks = Vec::new();
                for ((x, y), cell) in change {
                    let block = VoxelKey::pack([x, y, 7 - x]);
                    let mut mask = BlockMask::EMPTY;
                    if cell > 0 {
                        mask.insert(Cell::from_bits(cell));
                        model.insert(block, mask);
                    } else {
                        model.remove(&block);
                    }
                    blocks.push((block, mask));
                }
                ClusterUpdate::plan(&table, &blocks, StopSignal::NEVER).apply(&mut table);
                prop_assert_eq!(table.len(), model.len());
            }
            let mut found: Vec<_> = table.iter().collect();
            found.sort_by_key(|(block, _)| *block);
            prop_assert!(found.into_iter().eq(model.iter().map(|(k, m)| (*k, m))));
            for x in 0..60 {
                for y in -2..2 {
                    let block = VoxelKey::pack([x, y, 7 - x]);
                    prop_assert_eq!(table.get(block), &model.get(&block).copied().unwrap_or_default());
                }
            }
            let slots = table.keys.len() * (size_of::<Tags>() + BUCKET * 8) + table.clusters.len() * size_of::<Cluster>();
            prop_assert_eq!(table.bytes(), slots + model.len() * BlockMask::BYTES);
        }

        /// At a load that the table itself never allows, so that buckets overflow into one another.
        #[test]
        fn keys_that_overflow_are_found_and_removed(order in Just((0..37).collect::<Vec<i32>>()).prop_shuffle()) {
            let mut table =
                ClusterTable { tags: vec![0; 5], keys: vec![VACANT_BUCKET; 5], clusters: vacant(5), ..ClusterTable::default() };
            let key = |x: i32| VoxelKey::pack([x, 3, -9]);
            let first_mask = |table: &ClusterTable, x: i32| *table.get(key(x).first_within(2));
            for &x in &order {
                let slot = table.add_in_room(key(x).to_bits());
                table.clusters[slot] = cluster(key(x), x as u16);
                table.blocks += 1;
                table.mask_bytes += BlockMask::BYTES;
            }
            for (gone, &x) in order.iter().enumerate() {
                prop_assert!(order[gone..].iter().all(|&y| first_mask(&table, y).contains(Cell::from_bits(y as u16), 0)));
                table.set_cluster(key(x), Cluster::default());
                prop_assert!(first_mask(&table, x).is_empty());
            }
            prop_assert!(table.keys.iter().all(|bucket| *bucket == VACANT_BUCKET));
            prop_assert!(table.tags.iter().all(|&tags| tags == 0));
            prop_assert_eq!((table.len(), table.mask_bytes), (0, 0));
        }
    }

    #[test]
    fn clusters_of_a_plane_seldom_leave_their_home_bucket() {
        let mut table = ClusterTable::default();
        for x in 0..100 {
            for y in 0..100 {
                let key = VoxelKey::pack([x, y, x / 8]);
                table.set_cluster(key, cluster(key, 0));
            }
        }
        let full = table.keys.iter().filter(|bucket| bucket.0[BUCKET - 1] != VACANT).count();
        let share = full as f64 / table.keys.len() as f64;
        assert!(share < 0.02, "{share} of the buckets are full");
    }
}
