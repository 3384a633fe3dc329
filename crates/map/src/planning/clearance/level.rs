//! The field of one level: its clusters by key.

use super::block::cell_place;
use super::cluster::{CLUSTER_LEVELS, FieldCluster};
use crate::voxel::{BLOCK_LEVELS, BlockMask, VoxelKey};

/// Marks a vacant slot; no key sets bit 63.
const VACANT: u64 = u64::MAX;
/// Slots for each cluster, at least: searches end where they begin.
const SLOTS_A_CLUSTER: usize = 4;
const SLOTS_MIN: usize = 16;

/// A place of 8 x 8 x 8, x fastest, by the lowest three bits of an index.
#[inline(always)]
fn place(index: [i32; 3]) -> u32 {
    let [x, y, z] = index.map(|i| (i & 7) as u32);
    x | y << 3 | z << 6
}

#[derive(Debug)]
struct Slot {
    key: u64,
    cluster: Option<Box<FieldCluster>>,
}

impl Slot {
    const NONE: Self = Self { key: VACANT, cluster: None };
}

/// The clusters of a level's field in an open-addressed table.
#[derive(Debug)]
pub(in crate::planning) struct FieldLevel {
    /// A power of two of them.
    slots: Vec<Slot>,
    clusters: usize,
}

impl Default for FieldLevel {
    fn default() -> Self {
        Self::with_slots(SLOTS_MIN)
    }
}

impl FieldLevel {
    fn with_slots(slots: usize) -> Self {
        Self { slots: std::iter::repeat_with(|| Slot::NONE).take(slots).collect(), clusters: 0 }
    }

    /// The key of the cluster of the cell at `index`.
    #[inline(always)]
    pub(super) fn cluster_key(index: [i32; 3]) -> u64 {
        VoxelKey::pack(index.map(|i| i >> (BLOCK_LEVELS + CLUSTER_LEVELS))).to_bits()
    }

    /// The place of its block in the cluster.
    #[inline(always)]
    pub(super) fn block_place(index: [i32; 3]) -> u32 {
        place(index.map(|i| i >> BLOCK_LEVELS))
    }

    /// Its place in the block.
    #[inline(always)]
    pub(super) fn cell_place(index: [i32; 3]) -> u32 {
        cell_place(index)
    }

    /// The cluster with a key, where there is one.
    #[inline(always)]
    pub(super) fn cluster(&self, key: u64) -> Option<&FieldCluster> {
        let mask = self.slots.len() - 1;
        let mut at = Self::hash(key) & mask;
        loop {
            let slot = &self.slots[at & mask];
            if slot.key == key {
                return slot.cluster.as_deref();
            }
            if slot.key == VACANT {
                return None;
            }
            at += 1;
        }
    }

    #[inline(always)]
    fn hash(key: u64) -> usize {
        (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as usize
    }

    /// The obstacles in a block, as they were when it was made; none where it is not made.
    pub(super) fn obstacles(&self, block: VoxelKey) -> Option<BlockMask> {
        self.cluster(block.ancestor(CLUSTER_LEVELS).to_bits())?.obstacles(FieldCluster::place(block))
    }

    /// The cluster of a block, where there is one.
    pub(super) fn cluster_mut(&mut self, block: VoxelKey) -> Option<&mut FieldCluster> {
        let key = block.ancestor(CLUSTER_LEVELS).to_bits();
        let mask = self.slots.len() - 1;
        let mut at = Self::hash(key) & mask;
        while self.slots[at].key != key {
            if self.slots[at].key == VACANT {
                return None;
            }
            at = (at + 1) & mask;
        }
        self.slots[at].cluster.as_deref_mut()
    }

    /// Adds the cluster of a block, which is not there.
    pub(super) fn add_cluster(&mut self, block: VoxelKey) {
        if (self.clusters + 1) * SLOTS_A_CLUSTER > self.slots.len() {
            let larger = Self::with_slots(self.slots.len() * 2);
            let before = std::mem::replace(self, larger);
            before.slots.into_iter().for_each(|slot| self.put(slot.key, slot.cluster));
        }
        self.put(block.ancestor(CLUSTER_LEVELS).to_bits(), Some(Box::new(FieldCluster::new())));
    }

    fn put(&mut self, key: u64, cluster: Option<Box<FieldCluster>>) {
        if cluster.is_none() {
            return;
        }
        let mask = self.slots.len() - 1;
        let mut at = Self::hash(key) & mask;
        while self.slots[at].key != VACANT {
            at = (at + 1) & mask;
        }
        self.slots[at] = Slot { key, cluster };
        self.clusters += 1;
    }

    /// Takes a cluster out; the bytes that it held.
    pub(super) fn remove_cluster(&mut self, cluster: VoxelKey) -> usize {
        let (key, mask) = (cluster.to_bits(), self.slots.len() - 1);
        let mut hole = Self::hash(key) & mask;
        while self.slots[hole].key != key {
            if self.slots[hole].key == VACANT {
                return 0;
            }
            hole = (hole + 1) & mask;
        }
        let removed = std::mem::replace(&mut self.slots[hole], Slot::NONE);
        self.clusters -= 1;
        // Searches end at a vacant slot: those behind it that it would hide move up.
        let mut at = (hole + 1) & mask;
        while self.slots[at].key != VACANT {
            let home = Self::hash(self.slots[at].key) & mask;
            if at.wrapping_sub(home) & mask >= at.wrapping_sub(hole) & mask {
                self.slots.swap(hole, at);
                hole = at;
            }
            at = (at + 1) & mask;
        }
        removed.cluster.map_or(0, |cluster| cluster.bytes())
    }

    /// Forgets a block; true where it was made.
    pub(super) fn forget(&mut self, block: VoxelKey) {
        if let Some(cluster) = self.cluster_mut(block) {
            cluster.forget(FieldCluster::place(block));
        }
    }

    /// True without a cluster.
    pub(super) fn is_empty(&self) -> bool {
        self.clusters == 0
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// The block at the beginning of a cluster.
    fn block(cluster: i32) -> VoxelKey {
        VoxelKey::pack([cluster % 7 * 8, cluster / 7 * 8, -8 * (cluster % 3)])
    }

    proptest! {
        #[test]
        fn clusters_that_stay_are_found_whatever_is_taken_out(
            acts in prop::collection::vec((any::<bool>(), 0i32..60), 1..200),
        ) {
            let (mut level, mut model) = (FieldLevel::default(), BTreeSet::new());
            for (adds, cluster) in acts {
                let key = block(cluster);
                if adds && model.insert(cluster) {
                    level.add_cluster(key);
                } else if !adds {
                    let bytes = level.remove_cluster(key.ancestor(CLUSTER_LEVELS));
                    prop_assert_eq!(bytes > 0, model.remove(&cluster));
                }
                for cluster in 0..60 {
                    prop_assert_eq!(level.cluster_mut(block(cluster)).is_some(), model.contains(&cluster));
                }
                prop_assert_eq!(level.is_empty(), model.is_empty());
            }
        }
    }
}
