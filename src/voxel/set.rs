//! A set of finest voxels as sorted blocks: what a scan touches, a deletion takes, a snapshot keeps.

use std::collections::BTreeMap;

use super::block_table::BlockTable;
use super::{BLOCK_LEVELS, BlockMask, Cell, INDEX_MAX, INDEX_MIN, LatticeFromPoints, VoxelKey};
use crate::geometry::Point;

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
        let mut table = BlockTable::with_capacity(points.len() / 64);
        let mut skipped = 0;
        // Neighbours in a scan share blocks: one probe serves a run of points.
        let mut run: Option<(VoxelKey, BlockMask)> = None;
        for &point in points {
            let Some(index) = lattice_from_points.index(point) else {
                skipped += 1;
                continue;
            };
            let (block, cell) = Cell::of(index);
            match &mut run {
                Some((key, mask)) if *key == block => drop(mask.insert(cell)),
                _ => {
                    let mut mask = BlockMask::EMPTY;
                    mask.insert(cell);
                    flush(&mut table, run.replace((block, mask)));
                }
            }
        }
        flush(&mut table, run);
        (table.iter().collect(), skipped)
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

    /// The finest voxels, block by block.
    pub fn iter(&self) -> impl Iterator<Item = VoxelKey> + '_ {
        self.blocks.iter().flat_map(|(block, mask)| mask.cells(0).map(|cell| cell.voxel(*block)))
    }
}

fn flush(table: &mut BlockTable, run: Option<(VoxelKey, BlockMask)>) {
    if let Some((block, mask)) = run {
        let entry = table.entry(block);
        *entry = entry.union(&mask);
    }
}

impl FromIterator<(VoxelKey, BlockMask)> for VoxelSet {
    /// The union of `blocks`, in any order.
    fn from_iter<I: IntoIterator<Item = (VoxelKey, BlockMask)>>(blocks: I) -> Self {
        let mut blocks: Vec<_> = blocks.into_iter().filter(|(_, mask)| !mask.is_empty()).collect();
        blocks.sort_unstable_by_key(|(key, _)| *key);
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

impl FromIterator<VoxelKey> for VoxelSet {
    /// The set of `keys`, in any order, repeated or not.
    fn from_iter<I: IntoIterator<Item = VoxelKey>>(keys: I) -> Self {
        let mut blocks = BTreeMap::<VoxelKey, BlockMask>::new();
        for key in keys {
            let (block, cell) = Cell::of(key.index());
            blocks.entry(block).or_default().insert(cell);
        }
        blocks.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::Lattice;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_set_of_points_is_the_set_of_their_keys(points: Vec<[i8; 3]>) {
            let points: Vec<Point> = points.iter().map(|p| Point::from(p.map(f32::from))).collect();
            let quantise = Lattice::new(2.5, 1).unwrap().from_map();
            let keys: BTreeSet<VoxelKey> = points.iter().map(|&p| quantise.key(p).unwrap()).collect();
            let (set, skipped) = VoxelSet::of_points(&points, &quantise);
            prop_assert_eq!(skipped, 0);
            prop_assert_eq!(set.len(), keys.len());
            prop_assert_eq!(&set.iter().collect::<BTreeSet<_>>(), &keys);
            prop_assert_eq!(set, keys.into_iter().collect::<VoxelSet>());
        }
    }

    #[test]
    fn points_without_a_voxel_are_counted() {
        let points = [Point::new(f32::NAN, 0.0, 0.0), Point::new(0.1, 0.1, 0.1), Point::new(1e9, 0.0, 0.0)];
        let (set, skipped) = VoxelSet::of_points(&points, &Lattice::new(1.0, 1).unwrap().from_map());
        assert_eq!((set.len(), skipped), (1, 2));
    }
}
