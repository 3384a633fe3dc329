//! An exact set of voxels as an open-addressed table of blocks.

use super::{BlockMask, Cell, VoxelKey};

/// Marks a vacant slot; no key sets bit 63.
const VACANT: u64 = u64::MAX;
/// Slots of a bucket: eight keys are one cache line.
pub(crate) const BUCKET: usize = 8;
/// The keys of one bucket: those in use first.
pub(crate) type Bucket = CacheLine<[u64; BUCKET]>;
const VACANT_BUCKET: Bucket = CacheLine([VACANT; BUCKET]);
const EMPTY_MASK: CacheLine<BlockMask> = CacheLine(BlockMask::EMPTY);
/// Slots for each block, at least. At 2 one bucket in twenty is full (a Poisson tail), just after growth one in fifty:
/// nearly every search ends in the bucket where it began, and a wide look-up seldom has to leave its way.
const SLOTS_A_BLOCK: usize = 2;

/// What a look-up fetches in one piece: a bucket, or a block's mask. Vectors of them begin where a cache line does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(64))]
pub(crate) struct CacheLine<T>(pub(crate) T);

/// A byte of a key for each slot of a bucket, none of them zero; zero where the slot is vacant.
pub(crate) type Tags = u64;

/// Blocks by key, in buckets of eight.
///
/// ```text
/// tags    [ 8 x 8 bits | ... ]           which slots of a bucket may hold a key: all buckets' fit in a cache
/// keys    [ 8 keys | 8 keys | ... ]      a cache line a bucket; a search reads one, seldom two
/// masks   [ 8 x 64 bytes | ... ]         the block of keys[b][i] is masks[8 b + i]
/// ```
///
/// A key lives in its home bucket or, where that is full, in the next one that is not. A bucket's vacant slots
/// come last, so that its last key tells whether a search has to go on; removal pulls keys back instead of
/// leaving tombstones. Any number of buckets is allowed (the home is a multiply-shift of the hash, not a
/// remainder), so that a table grows in small steps and stays near its memory budget.
#[derive(Debug, Clone)]
pub struct BlockTable {
    tags: Vec<Tags>,
    keys: Vec<Bucket>,
    masks: Vec<CacheLine<BlockMask>>,
    len: usize,
}

impl BlockTable {
    /// An empty table with room for `blocks` blocks.
    pub fn with_capacity(blocks: usize) -> Self {
        // One slot more than the load allows for, so that a search always meets a bucket that is not full.
        let buckets = (blocks * SLOTS_A_BLOCK + 1).div_ceil(BUCKET);
        Self {
            tags: vec![0; buckets],
            keys: vec![VACANT_BUCKET; buckets],
            masks: vec![EMPTY_MASK; buckets * BUCKET],
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
        (self.masks.len() - 1) / SLOTS_A_BLOCK
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.tags[..]) + size_of_val(&self.keys[..]) + size_of_val(&self.masks[..])
    }

    /// What the look-up kernels read.
    pub(crate) fn slots(&self) -> Slots<'_> {
        Slots { tags: &self.tags, keys: &self.keys, masks: &self.masks }
    }

    /// The voxels of `block`; none of them when the block is absent.
    #[inline]
    pub fn get(&self, block: VoxelKey) -> BlockMask {
        self.slots().find(block.to_bits()).map_or(BlockMask::EMPTY, |slot| self.masks[slot].0)
    }

    /// True when the voxel at `index`, or at `level` (0, 1 or 2) its ancestor, is occupied.
    #[inline]
    pub fn contains(&self, index: [i32; 3], level: u32) -> bool {
        let (block, cell) = Cell::of(index.map(|i| i << level));
        self.slots().contains(block, cell, level)
    }

    /// The keys among which the search for `block` begins.
    #[inline]
    pub(crate) fn home(&self, block: VoxelKey) -> &Bucket {
        &self.keys[Slots::home(block.to_bits(), self.keys.len())]
    }

    /// Where `block` is, until the table changes.
    #[inline]
    pub(crate) fn find(&self, block: VoxelKey) -> Option<usize> {
        self.slots().find(block.to_bits())
    }

    /// The voxels of the block at `slot`.
    #[inline]
    pub(crate) fn at(&self, slot: usize) -> &BlockMask {
        &self.masks[slot].0
    }

    /// The same, to be added to.
    #[inline]
    pub(crate) fn at_mut(&mut self, slot: usize) -> &mut BlockMask {
        &mut self.masks[slot].0
    }

    /// The mask of `block` to be added to, which is empty where the block was absent. The caller leaves at
    /// least one voxel in it.
    #[inline]
    pub(crate) fn entry(&mut self, block: VoxelKey) -> &mut BlockMask {
        let key = block.to_bits();
        let slot = match self.slots().find(key) {
            Some(slot) => slot,
            None => self.add(key),
        };
        &mut self.masks[slot].0
    }

    /// The slot of a key that was absent.
    fn add(&mut self, key: u64) -> usize {
        if self.len >= self.capacity() {
            *self = self.with_room_for(self.len * 5 / 4 + 4);
        }
        self.add_in_room(key)
    }

    /// The same, where there is a vacant slot.
    fn add_in_room(&mut self, key: u64) -> usize {
        self.len += 1;
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

    fn after(&self, bucket: usize) -> usize {
        if bucket + 1 == self.keys.len() { 0 } else { bucket + 1 }
    }

    /// Replaces the voxels of `block`; an empty mask takes the block out.
    pub(crate) fn set(&mut self, block: VoxelKey, mask: BlockMask) {
        if !mask.is_empty() {
            *self.entry(block) = mask;
        } else if let Some(slot) = self.slots().find(block.to_bits()) {
            self.len -= 1;
            self.vacate(slot);
        }
    }

    /// Empties `slot`, and where that makes room in a full bucket, pulls back a key that had to go past it.
    fn vacate(&mut self, slot: usize) {
        let (bucket, was_full) = (slot / BUCKET, self.keys[slot / BUCKET].0[BUCKET - 1] != VACANT);
        let last = (0..BUCKET).rev().find(|&i| self.keys[bucket].0[i] != VACANT).unwrap_or_default();
        self.relocate(bucket * BUCKET + last, slot);
        if was_full && let Some(displaced) = self.displaced_past(bucket) {
            let (key, mask) = (self.keys[displaced / BUCKET].0[displaced % BUCKET], self.masks[displaced]);
            self.set_key(bucket * BUCKET + BUCKET - 1, key);
            self.masks[bucket * BUCKET + BUCKET - 1] = mask;
            self.vacate(displaced);
        }
    }

    /// Moves a key and its mask; `from` is vacant afterwards.
    fn relocate(&mut self, from: usize, to: usize) {
        self.set_key(to, self.keys[from / BUCKET].0[from % BUCKET]);
        self.masks[to] = self.masks[from];
        self.set_key(from, VACANT);
        self.masks[from] = EMPTY_MASK;
    }

    fn set_key(&mut self, slot: usize, key: u64) {
        let (bucket, place) = (slot / BUCKET, slot % BUCKET);
        self.keys[bucket].0[place] = key;
        let tag = if key == VACANT { 0 } else { Slots::tag(Slots::hash(key)) };
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

    /// A copy with room for `blocks` blocks.
    pub(crate) fn with_room_for(&self, blocks: usize) -> Self {
        let mut table = Self::with_capacity(blocks.max(self.len));
        for (block, mask) in self.iter() {
            *table.entry(block) = *mask;
        }
        table
    }

    /// All blocks, in no order.
    pub fn iter(&self) -> impl Iterator<Item = (VoxelKey, &BlockMask)> {
        let buckets = self.keys.iter().zip(self.masks.chunks_exact(BUCKET));
        // A bucket's vacant slots come last.
        buckets.flat_map(|(bucket, masks)| {
            bucket.0.iter().zip(masks).map_while(|(&key, mask)| Some((VoxelKey::from_bits(key)?, &mask.0)))
        })
    }
}

/// A table's slots as plain slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slots<'a> {
    pub(crate) tags: &'a [Tags],
    pub(crate) keys: &'a [Bucket],
    pub(crate) masks: &'a [CacheLine<BlockMask>],
}

impl Slots<'static> {
    /// Those of a table without a block.
    pub(crate) const NONE: Self = Self { tags: &[0], keys: &[VACANT_BUCKET], masks: &[EMPTY_MASK; BUCKET] };
}

impl Slots<'_> {
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
    fn tag(hash: u64) -> Tags {
        (hash >> Self::TAG_SHIFT & 0xff).max(1)
    }

    /// True when a search must go on past the bucket: its vacant slots come last.
    #[inline(always)]
    pub(crate) fn is_full(bucket: &[u64; BUCKET]) -> bool {
        bucket[BUCKET - 1] != VACANT
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

    /// True when a voxel within the ancestor of `cell` of `block`, `level` levels up, is occupied.
    #[inline(always)]
    pub(crate) fn contains(self, block: VoxelKey, cell: Cell, level: u32) -> bool {
        self.find(block.to_bits()).is_some_and(|slot| self.masks[slot].0.contains(cell, level))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn a_table_holds_what_was_set_last(changes in prop::collection::vec((0i32..60, 0u16..3), 0..800)) {
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
            prop_assert!(found.into_iter().eq(model.iter().map(|(k, m)| (*k, m))));
            for x in 0..60 {
                let block = VoxelKey::pack([x, -x, 7]);
                prop_assert!(table.get(block) == model.get(&block).copied().unwrap_or_default());
            }
        }

        /// At a load that the table itself never allows, so that buckets overflow into one another.
        #[test]
        fn keys_that_overflow_are_found_and_removed(order in Just((0..37).collect::<Vec<i32>>()).prop_shuffle()) {
            let mut table = BlockTable::with_capacity(0);
            (table.keys, table.masks) = (vec![VACANT_BUCKET; 5], vec![EMPTY_MASK; 40]);
            table.tags = vec![0; 5];
            let block = |x: i32| VoxelKey::pack([x, 3, -9]);
            for &x in &order {
                let slot = table.add_in_room(block(x).to_bits());
                table.masks[slot].0.insert(Cell::from_bits(x as u16));
            }
            for (gone, &x) in order.iter().enumerate() {
                prop_assert!(order[gone..].iter().all(|&y| table.get(block(y)).contains(Cell::from_bits(y as u16), 0)));
                table.set(block(x), BlockMask::EMPTY);
                prop_assert!(table.get(block(x)).is_empty());
            }
            prop_assert!(table.keys.iter().all(|bucket| *bucket == VACANT_BUCKET));
            prop_assert!(table.tags.iter().all(|&tags| tags == 0));
        }
    }

    #[test]
    fn blocks_of_a_plane_seldom_leave_their_home_bucket() {
        let mut table = BlockTable::with_capacity(10_000);
        for x in 0..100 {
            for y in 0..100 {
                table.entry(VoxelKey::pack([x, y, x / 8])).insert(Cell::from_bits(0));
            }
        }
        let full = table.keys.iter().filter(|bucket| bucket.0[BUCKET - 1] != VACANT).count();
        let share = full as f64 / table.keys.len() as f64;
        assert!((0.01..0.1).contains(&share), "{share} of the buckets are full");
    }
}
