//! A set of finest voxels as sorted blocks: what a scan touches, a deletion takes, a snapshot keeps.

use super::block::{BLOCK_LEVELS, BlockMask, Cell};
use super::block_sort::blocks_of;
use super::key::{INDEX_MAX, INDEX_MIN, VoxelKey};
use super::lattice::LatticeFromPoints;
use super::moments::MOMENT_LEVEL;
use super::quantize;
use crate::geometry::Point;
use crate::util::{StopSignal, sort_by_key_giving_way, sort_by_key_until};

/// Blocks that are worked on between two looks at the stop signal: some milliseconds.
pub const BLOCKS_PER_STOP_CHECK: usize = 16 << 10;

/// Distinct finest voxels, as blocks in ascending order of their keys; no block is empty.
///
/// Every bulk change of a map is one of these: canonical (equal sets are equal values), integer, and already
/// grouped by block, so that a change costs one probe a block rather than one a voxel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct VoxelSet {
    blocks: Vec<(VoxelKey, BlockMask)>,
}

impl std::fmt::Debug for BlockMask {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} voxels", self.count(0))
    }
}

impl VoxelSet {
    /// The voxels that `points` fall in. Points without a voxel (not finite, out of range) are left out and
    /// counted.
    pub fn of_points(points: &[Point], lattice_from_points: &LatticeFromPoints) -> (Self, usize) {
        let mut keys = vec![0; points.len()];
        quantize::keys(points, lattice_from_points, 0, &mut keys);
        let voxels: Vec<_> = keys.into_iter().filter_map(VoxelKey::from_bits).collect();
        let skipped = points.len() - voxels.len();
        (voxels.into_iter().collect(), skipped)
    }

    /// The key of a block from its packed form; none when no finest voxel can lie in it.
    pub fn block_key(bits: u64) -> Option<VoxelKey> {
        let blocks = INDEX_MIN >> BLOCK_LEVELS..=INDEX_MAX >> BLOCK_LEVELS;
        VoxelKey::from_bits(bits).filter(|key| key.index().iter().all(|i| blocks.contains(i)))
    }

    /// The blocks, ascending by key.
    pub fn blocks(&self) -> &[(VoxelKey, BlockMask)] {
        &self.blocks
    }

    /// Number of finest voxels.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|(_, mask)| mask.count(0)).sum()
    }

    /// True without a voxel.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// True where the voxel is in the set.
    pub fn contains(&self, voxel: VoxelKey) -> bool {
        let (block, cell) = Cell::of(voxel.index());
        let found = self.blocks.binary_search_by_key(&block, |(block, _)| *block);
        found.is_ok_and(|i| self.blocks[i].1.contains(cell, 0))
    }

    /// True where the two share no voxel.
    pub fn is_disjoint(&self, other: &Self) -> bool {
        let mut others = other.blocks.iter().peekable();
        self.blocks.iter().all(|(block, mask)| {
            while others.next_if(|(other, _)| other < block).is_some() {}
            let same = others.peek().filter(|(other, _)| other == block);
            same.is_none_or(|(_, other)| mask.intersection(other).is_empty())
        })
    }

    /// The voxels of this that are not in `other`.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Self {
        let mut others = other.blocks.iter().peekable();
        let rest = self.blocks.iter().filter_map(|(block, mask)| {
            while others.next_if(|(other, _)| other < block).is_some() {}
            let same = others.peek().filter(|(other, _)| other == block);
            let mask = same.map_or(*mask, |(_, other)| mask.difference(other));
            (!mask.is_empty()).then_some((*block, mask))
        });
        Self { blocks: rest.collect() }
    }

    /// True where a voxel of the block lies in `voxel` of `level`.
    pub fn block_touches((block, mask): &(VoxelKey, BlockMask), voxel: VoxelKey, level: u32) -> bool {
        match level.checked_sub(BLOCK_LEVELS) {
            Some(above) => block.ancestor(above) == voxel,
            None => {
                let (of_voxel, cell) = Cell::of(voxel.index().map(|i| i << level));
                of_voxel == *block && mask.contains(cell, level)
            }
        }
    }

    /// The finest voxels, block by block.
    pub fn iter(&self) -> impl Iterator<Item = VoxelKey> + '_ {
        self.blocks.iter().flat_map(|(block, mask)| mask.cells(0).map(|cell| cell.voxel(*block)))
    }

    /// The voxels of [`MOMENT_LEVEL`] that hold one of these, ascending: those with moments of points, where every
    /// voxel has a point.
    pub fn moment_voxels(&self) -> Vec<VoxelKey> {
        self.moment_voxels_until(StopSignal::NEVER)
    }

    /// [`VoxelSet::moment_voxels`] under a stop signal; once stopped, some of them.
    pub fn moment_voxels_until(&self, stop: StopSignal<'_>) -> Vec<VoxelKey> {
        let of_block = |(block, mask): &(VoxelKey, BlockMask)| {
            let block = *block;
            mask.cells(MOMENT_LEVEL).map(move |cell| cell.voxel(block).ancestor(MOMENT_LEVEL))
        };
        let blocks = stop.pieces(&self.blocks, BLOCKS_PER_STOP_CHECK).flatten();
        let mut voxels: Vec<VoxelKey> = blocks.flat_map(of_block).collect();
        sort_by_key_until(&mut voxels, |voxel| *voxel, stop);
        voxels
    }

    /// The union of `blocks`, in any order; once stopped, some of it.
    pub fn of_blocks_until(mut blocks: Vec<(VoxelKey, BlockMask)>, stop: StopSignal<'_>) -> Self {
        blocks.retain(|(_, mask)| !mask.is_empty());
        sort_by_key_until(&mut blocks, |(key, _)| *key, stop);
        Self::of_sorted(blocks)
    }

    /// [`VoxelSet::of_blocks_until`] that lets other work go first between its parts: for callers that hold no lock.
    pub fn of_blocks_giving_way(mut blocks: Vec<(VoxelKey, BlockMask)>, stop: StopSignal<'_>) -> Self {
        blocks.retain(|(_, mask)| !mask.is_empty());
        sort_by_key_giving_way(&mut blocks, |(key, _)| *key, stop);
        Self::of_sorted(blocks)
    }

    fn of_sorted(mut blocks: Vec<(VoxelKey, BlockMask)>) -> Self {
        blocks.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                kept.1 = kept.1.union(&later.1);
            }
            same
        });
        Self { blocks }
    }
}

impl FromIterator<(VoxelKey, BlockMask)> for VoxelSet {
    /// The union of `blocks`, in any order.
    fn from_iter<I: IntoIterator<Item = (VoxelKey, BlockMask)>>(blocks: I) -> Self {
        let blocks = blocks.into_iter().filter(|(_, mask)| !mask.is_empty()).collect();
        Self::of_blocks_until(blocks, StopSignal::NEVER)
    }
}

impl FromIterator<VoxelKey> for VoxelSet {
    /// The set of `keys`, in any order, repeated or not.
    fn from_iter<I: IntoIterator<Item = VoxelKey>>(keys: I) -> Self {
        Self { blocks: blocks_of(&keys.into_iter().collect::<Vec<_>>()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::lattice::Lattice;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_set_of_points_is_the_set_of_their_keys(points: Vec<[i8; 3]>) {
            let points: Vec<Point> = points.iter().map(|p| Point::from(p.map(f32::from))).collect();
            let quantize = Lattice::new(2.5, 1).unwrap().from_map();
            let keys: BTreeSet<VoxelKey> = points.iter().map(|&p| quantize.key(p).unwrap()).collect();
            let (set, skipped) = VoxelSet::of_points(&points, &quantize);
            prop_assert_eq!(skipped, 0);
            prop_assert_eq!(set.len(), keys.len());
            prop_assert_eq!(&set.iter().collect::<BTreeSet<_>>(), &keys);
            for index in [[0, 0, 0], [1, -1, 0], [-7, 3, 2]].into_iter().chain(keys.iter().map(|key| key.index())) {
                let key = VoxelKey::new(index).unwrap();
                prop_assert_eq!(set.contains(key), keys.contains(&key));
            }
            prop_assert_eq!(set, keys.into_iter().collect::<VoxelSet>());
        }
    }

    proptest! {
        #[test]
        fn a_difference_is_that_of_the_voxels(ours: Vec<[i8; 3]>, theirs: Vec<[i8; 3]>) {
            let keys = |all: &[[i8; 3]]| -> BTreeSet<VoxelKey> {
                all.iter().filter_map(|i| VoxelKey::new(i.map(|i| i32::from(i) / 16))).collect()
            };
            let (ours, theirs) = (keys(&ours), keys(&theirs));
            let expected: VoxelSet = ours.difference(&theirs).copied().collect();
            let set = |keys: &BTreeSet<VoxelKey>| keys.iter().copied().collect::<VoxelSet>();
            prop_assert_eq!(set(&ours).difference(&set(&theirs)), expected);
        }
    }

    #[test]
    fn points_without_a_voxel_are_counted() {
        let points = [Point::new(f32::NAN, 0.0, 0.0), Point::new(0.1, 0.1, 0.1), Point::new(1e9, 0.0, 0.0)];
        let (set, skipped) = VoxelSet::of_points(&points, &Lattice::new(1.0, 1).unwrap().from_map());
        assert_eq!((set.len(), skipped), (1, 2));
    }
}
