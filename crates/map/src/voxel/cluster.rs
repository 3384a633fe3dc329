//! Clusters of 4 x 4 x 4 blocks: which of them are there in one word, their masks packed behind it.

use super::block::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell};
use super::key::{AXIS_BITS, VoxelKey};
use crate::util::bits::for_each_bit;

/// Levels from a block up to its cluster.
pub(crate) const CLUSTER_LEVELS: u32 = 2;
/// Voxels along a cluster's side.
pub(crate) const CLUSTER_SIDE: i32 = BLOCK_SIDE << CLUSTER_LEVELS;
/// The bits of a block's index that say where in its cluster it is.
const PLACE_MASK: u64 = (1 << CLUSTER_LEVELS) - 1;

/// What a look-up fetches in one piece: a bucket, or a block's mask. Vectors of them begin where a cache line does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(64))]
pub(crate) struct CacheLine<T>(pub(crate) T);

/// Position of a block in its cluster, 0..64.
///
/// ```text
/// bit 5 4 | 3 2 | 1 0
///      z  |  y  |  x
/// ```
///
/// So the blocks of a cluster ascend as their keys do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct BlockInCluster(u32);

impl BlockInCluster {
    /// The cluster (a key two levels coarser than blocks) and the place of `block`.
    #[inline(always)]
    pub(crate) fn of(block: VoxelKey) -> (VoxelKey, Self) {
        let axis = |axis: u32| (block.to_bits() >> (axis * AXIS_BITS) & PLACE_MASK) as u32;
        (block.ancestor(CLUSTER_LEVELS), Self(axis(0) | axis(1) << 2 | axis(2) << 4))
    }

    /// The place in its cluster of the block that holds the voxel at `index`.
    #[inline(always)]
    pub(crate) fn of_voxel(index: [i32; 3]) -> Self {
        let axis = |axis: usize| (index[axis] >> BLOCK_LEVELS) as u32 & PLACE_MASK as u32;
        Self(axis(0) | axis(1) << 2 | axis(2) << 4)
    }

    /// The place of the number in the low six bits of `n`.
    #[inline(always)]
    pub(crate) fn from_number(n: u32) -> Self {
        Self(n & 63)
    }

    /// How many blocks of the cluster lie before this one along each axis.
    #[inline(always)]
    pub(crate) fn index(self) -> [usize; 3] {
        [0, 2, 4].map(|shift| (self.0 >> shift & 3) as usize)
    }

    /// The block here in `cluster`: the inverse of [`BlockInCluster::of`].
    #[inline(always)]
    fn block(self, cluster: VoxelKey) -> VoxelKey {
        let axis = |axis: u32| (u64::from(self.0) >> (2 * axis) & PLACE_MASK) << (axis * AXIS_BITS);
        cluster.first_within(CLUSTER_LEVELS).offset_by(axis(0) | axis(1) | axis(2))
    }

    /// The block's bit among those of a cluster.
    #[inline(always)]
    pub(crate) fn bit(self) -> u64 {
        1 << self.0
    }
}

/// The blocks of a cluster that hold a voxel, at most 64, as the nodes of a hash array mapped trie are packed (Bagwell,
/// *Ideal Hash Trees*, 2001).
///
/// ```text
/// present   bit p: the block at place p is there
/// masks     theirs, ascending: that at place p is masks[ones(present & ((1 << p) - 1))]
/// ```
///
/// Surfaces fill a sixth to a third of a cluster. So there is no room for what is not there, and one search finds the
/// blocks of a good many points.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Cluster {
    pub(crate) present: u64,
    /// Address of the first mask, for the wide look-ups: where a box keeps its own is not said.
    pub(crate) first_mask: usize,
    masks: Box<[CacheLine<BlockMask>]>,
}

impl Cluster {
    fn new(present: u64, masks: Box<[CacheLine<BlockMask>]>) -> Self {
        Self { present, first_mask: masks.as_ptr().expose_provenance(), masks }
    }

    /// A copy with the blocks of `present`: without the others of this one, and without a voxel in those that are new.
    pub(crate) fn with_blocks(&self, present: u64) -> Self {
        let mut masks = Vec::with_capacity(present.count_ones() as usize);
        for_each_bit(present, |place| masks.push(CacheLine(*self.get(BlockInCluster(place)))));
        Self::new(present, masks.into_boxed_slice())
    }

    /// Number of blocks.
    pub(crate) fn len(&self) -> usize {
        self.masks.len()
    }

    /// Bytes of memory held by the masks.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.masks[..])
    }

    /// The voxels of the block at `place`; none of them where it is absent.
    #[inline(always)]
    pub(crate) fn get(&self, place: BlockInCluster) -> &BlockMask {
        match self.present & place.bit() {
            0 => &BlockMask::EMPTY,
            _ => &self.masks[self.rank(place)].0,
        }
    }

    /// How large the empty aligned cube around `cell` of the block at `place` is: the levels, 0 to 5, from a cell up to
    /// it, which then is a block at 3 and the cluster at 5. None where the ancestor of `cell`, `level` (0, 1 or 2)
    /// levels up, is occupied.
    #[inline(always)]
    pub(crate) fn empty_levels(&self, place: BlockInCluster, cell: Cell, level: u32) -> Option<u32> {
        let octant = Self::OCTANT << (place.0 & Self::OCTANT_FIRST);
        let is_empty = |places: u64| u32::from(self.present & places == 0);
        let of_blocks = is_empty(place.bit()) + is_empty(octant) + is_empty(u64::MAX);
        Some(self.get(place).empty_levels(cell, level)? + of_blocks)
    }

    /// The first octant of a cluster, 2 x 2 x 2 blocks of it; and the bits of a place that say in which octant it is.
    const OCTANT: u64 = 0x0033_0033;
    const OCTANT_FIRST: u32 = 0b10_1010;

    /// Gives the block at `place`, which is there, other voxels.
    ///
    /// # Panics
    /// When it is not there, and none after it.
    pub(crate) fn set(&mut self, place: BlockInCluster, mask: BlockMask) {
        debug_assert!(self.present & place.bit() != 0);
        let rank = self.rank(place);
        self.masks[rank].0 = mask;
    }

    /// How many blocks are before `place`.
    #[inline(always)]
    fn rank(&self, place: BlockInCluster) -> usize {
        (self.present & (place.bit() - 1)).count_ones() as usize
    }

    /// The blocks of this one, whose key is `cluster`, ascending.
    pub(crate) fn blocks(&self, cluster: VoxelKey) -> impl Iterator<Item = (VoxelKey, &BlockMask)> {
        let mut rest = self.present;
        let places = std::iter::from_fn(move || {
            let place = (rest != 0).then(|| rest.trailing_zeros())?;
            rest &= rest - 1;
            Some(BlockInCluster(place))
        });
        places.zip(&self.masks).map(move |(place, mask)| (place.block(cluster), &mask.0))
    }
}

impl Default for Cluster {
    /// No block.
    fn default() -> Self {
        Self::new(0, Box::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn mask(cell: u16) -> BlockMask {
        let mut mask = BlockMask::EMPTY;
        mask.insert(Cell::from_bits(cell));
        mask
    }

    proptest! {
        #[test]
        fn the_empty_cube_around_a_cell_is_the_largest_without_an_occupied_cell(
            present in prop_oneof![any::<u64>(), any::<[u64; 4]>().prop_map(|[a, b, c, d]| a & b & c & d), Just(0)],
            cells in prop::collection::vec(0u16..512, 1..4),
            asked in prop::array::uniform3(0i32..32),
            level in 0u32..3,
        ) {
            let mut cluster = Cluster::default().with_blocks(present);
            let mut occupied = Vec::new();
            for_each_bit(present, |place| {
                let mut mask = BlockMask::EMPTY;
                let block = BlockInCluster(place).block(VoxelKey::default());
                for &cell in &cells {
                    mask.insert(Cell::from_bits(cell));
                    occupied.push(Cell::from_bits(cell).voxel(block).index());
                }
                cluster.set(BlockInCluster(place), mask);
            });
            let is_empty = |levels: u32| {
                let cube = asked.map(|i| i >> levels);
                occupied.iter().all(|cell| cell.map(|i| i >> levels) != cube)
            };
            let expected = (level..=5).take_while(|&levels| is_empty(levels)).last();
            let found = cluster.empty_levels(BlockInCluster::of_voxel(asked), Cell::of(asked).1, level);
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn a_block_is_its_cluster_and_place(index in prop::array::uniform3(-131_072i32..131_072)) {
            let block = VoxelKey::pack(index);
            let (cluster, place) = BlockInCluster::of(block);
            prop_assert_eq!(cluster, block.ancestor(CLUSTER_LEVELS));
            prop_assert_eq!(place.block(cluster), block);
        }

        #[test]
        fn a_cluster_holds_a_mask_for_each_block_that_is_there(present: u64, after: u64, wanted: [i16; 3]) {
            let key = VoxelKey::pack(wanted.map(i32::from));
            let mut cluster = Cluster::default().with_blocks(present);
            for_each_bit(present, |place| cluster.set(BlockInCluster(place), mask(place as u16)));
            let cluster = cluster.with_blocks(after);
            prop_assert_eq!(cluster.len(), after.count_ones() as usize);
            let mut expected = BTreeMap::new();
            for place in (0..64).map(BlockInCluster) {
                let kept = if present & after & place.bit() == 0 { BlockMask::EMPTY } else { mask(place.0 as u16) };
                prop_assert_eq!(cluster.get(place), &kept);
                if after & place.bit() != 0 {
                    expected.insert(place.block(key), kept);
                }
            }
            let found: Vec<_> = cluster.blocks(key).map(|(block, mask)| (block, *mask)).collect();
            prop_assert_eq!(found, expected.into_iter().collect::<Vec<_>>());
        }
    }
}
