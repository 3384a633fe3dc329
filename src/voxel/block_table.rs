//! An exact set of voxels as an open-addressed table of blocks.

use super::{BlockMask, Cell, VoxelKey};

/// Marks a vacant slot; no key sets bit 63.
pub(crate) const VACANT: u64 = u64::MAX;
/// Slots in use, at most, of each `LOAD_OF`.
const LOAD: usize = 3;
const LOAD_OF: usize = 4;

/// Blocks by key: linear probing from a multiplicative hash, deletion by shifting back, so that a probe ends
/// at the first vacant slot and no tombstone is ever left.
///
/// Any number of slots is allowed (the home slot is a multiply-shift of the hash, not a remainder), so that a
/// table grows by a quarter and stays near its memory budget.
#[derive(Debug, Clone)]
pub struct BlockTable {
    /// Always at least one vacant slot.
    keys: Vec<u64>,
    masks: Vec<BlockMask>,
    len: usize,
}

impl BlockTable {
    /// An empty table with room for `blocks` blocks.
    pub fn with_capacity(blocks: usize) -> Self {
        let slots = blocks * LOAD_OF / LOAD + 2;
        Self {
            keys: vec![VACANT; slots],
            masks: vec![BlockMask::EMPTY; slots],
            len: 0,
        }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without a block.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Blocks that fit before the table has to grow.
    pub fn capacity(&self) -> usize {
        (self.keys.len() - 2) * LOAD / LOAD_OF
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        self.keys.len() * (size_of::<u64>() + size_of::<BlockMask>())
    }

    /// The slots' keys ([`VACANT`] where there is none) and masks, for the look-up kernels.
    pub(crate) fn slots(&self) -> (&[u64], &[BlockMask]) {
        (&self.keys, &self.masks)
    }

    /// The slot where the search for `key` starts among `slots` slots.
    ///
    /// ```text
    /// home = high32(mix(key)) * slots >> 32,   mix = (k * A ^ (k * A) >> 32) * B
    /// ```
    #[inline(always)]
    pub(crate) fn home(key: u64, slots: usize) -> usize {
        let h = key.wrapping_mul(Self::HASH_A);
        let h = (h ^ h >> 32).wrapping_mul(Self::HASH_B);
        ((h >> 32) * slots as u64 >> 32) as usize
    }

    pub(crate) const HASH_A: u64 = 0x9e37_79b9_7f4a_7c15;
    pub(crate) const HASH_B: u64 = 0xd6e8_feb8_6659_fd93;

    /// The slot of `key`, or the vacant slot where it would go.
    #[inline(always)]
    fn find(&self, key: u64) -> (usize, bool) {
        let mut slot = Self::home(key, self.keys.len());
        loop {
            match self.keys[slot] {
                k if k == key => return (slot, true),
                VACANT => return (slot, false),
                _ => slot = self.after(slot),
            }
        }
    }

    #[inline(always)]
    fn after(&self, slot: usize) -> usize {
        if slot + 1 == self.keys.len() { 0 } else { slot + 1 }
    }

    /// The voxels of `block`; none of them when the block is absent.
    #[inline]
    pub fn get(&self, block: VoxelKey) -> BlockMask {
        match self.find(block.to_bits()) {
            (slot, true) => self.masks[slot],
            _ => BlockMask::EMPTY,
        }
    }

    /// True when the voxel at `index`, or at `level` (0, 1 or 2) its ancestor, is occupied.
    #[inline]
    pub fn contains(&self, index: [i32; 3], level: u32) -> bool {
        let (block, cell) = Cell::of(index.map(|i| i << level));
        self.get(block).contains(cell, level)
    }

    /// The mask of `block` to be added to, which is empty where the block was absent. The caller leaves at
    /// least one voxel in it.
    #[inline]
    pub(crate) fn entry(&mut self, block: VoxelKey) -> &mut BlockMask {
        let (mut slot, found) = self.find(block.to_bits());
        if !found {
            if self.len >= self.capacity() {
                *self = self.resized(self.len + 1);
                slot = self.find(block.to_bits()).0;
            }
            self.keys[slot] = block.to_bits();
            self.len += 1;
        }
        &mut self.masks[slot]
    }

    /// Replaces the voxels of `block`; an empty mask takes the block out.
    pub(crate) fn set(&mut self, block: VoxelKey, mask: BlockMask) {
        if !mask.is_empty() {
            *self.entry(block) = mask;
        } else if let (slot, true) = self.find(block.to_bits()) {
            self.vacate(slot);
        }
    }

    /// Empties `slot` and moves back what was displaced past it.
    fn vacate(&mut self, mut hole: usize) {
        self.len -= 1;
        let slots = self.keys.len();
        let mut slot = hole;
        loop {
            slot = self.after(slot);
            if self.keys[slot] == VACANT {
                break;
            }
            let home = Self::home(self.keys[slot], slots);
            let displaced_by = (slot + slots - home) % slots;
            if displaced_by >= (slot + slots - hole) % slots {
                self.keys[hole] = self.keys[slot];
                self.masks[hole] = self.masks[slot];
                hole = slot;
            }
        }
        self.keys[hole] = VACANT;
        self.masks[hole] = BlockMask::EMPTY;
    }

    /// A copy with room for `blocks` blocks and a quarter more.
    pub(crate) fn resized(&self, blocks: usize) -> Self {
        let mut table = Self::with_capacity(blocks.max(self.len) * 5 / 4 + 4);
        for (block, mask) in self.iter() {
            *table.entry(block) = mask;
        }
        table
    }

    /// All blocks, in no order.
    pub fn iter(&self) -> impl Iterator<Item = (VoxelKey, BlockMask)> + '_ {
        let occupied = |(&key, &mask): (&u64, &BlockMask)| Some((VoxelKey::from_bits(key)?, mask));
        self.keys.iter().zip(&self.masks).filter_map(occupied)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn a_table_holds_what_was_set_last(changes in prop::collection::vec((0i32..40, 0u16..3), 0..400)) {
            let mut table = BlockTable::with_capacity(0);
            let mut model = BTreeMap::new();
            for (x, cell) in changes {
                let block = VoxelKey::pack([x, -x, 7]);
                let mut mask = BlockMask::EMPTY;
                if cell > 0 {
                    mask.insert(Cell::from_bits(cell));
                    model.insert(block, mask);
                } else {
                    model.remove(&block);
                }
                table.set(block, mask);
                prop_assert_eq!(table.len(), model.len());
            }
            let mut found: Vec<_> = table.iter().collect();
            found.sort_by_key(|(block, _)| *block);
            prop_assert!(found.into_iter().eq(model.iter().map(|(k, m)| (*k, *m))));
            for x in 0..40 {
                let block = VoxelKey::pack([x, -x, 7]);
                prop_assert!(table.get(block) == model.get(&block).copied().unwrap_or_default());
            }
        }
    }

    #[test]
    fn blocks_of_a_plane_are_found_within_a_few_probes() {
        let mut table = BlockTable::with_capacity(10_000);
        for x in 0..100 {
            for y in 0..100 {
                table
                    .entry(VoxelKey::pack([x, y, x / 8]))
                    .insert(Cell::from_bits(0));
            }
        }
        let displaced: usize = table
            .keys
            .iter()
            .enumerate()
            .filter(|(_, key)| **key != VACANT)
            .map(|(slot, &key)| {
                (slot + table.keys.len() - BlockTable::home(key, table.keys.len())) % table.keys.len()
            })
            .sum();
        // Linear probing at load 3/4 expects (1 / (1 - 0.75) - 1) / 2 = 1.5 extra probes for a hit.
        let mean = displaced as f64 / table.len() as f64;
        assert!(mean < 1.8, "mean displacement {mean}");
    }
}
