//! Which voxels would not be there without certain scans.

use std::collections::{BTreeMap, BTreeSet};

use super::{Change, MapContents, WithdrawnScan};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, MomentSet, Moments, VoxelKey, VoxelSet};

/// Who holds each voxel: scans that are to be undone, others, or both.
///
/// A scan holds the voxels that it touched, until a deletion takes them from everybody or the scan is undone; a
/// voxel is occupied as long as somebody holds it. So a map without certain scans follows from its changes: it is
/// what replaying them without those scans would give, with the deletions as they were.
#[derive(Debug)]
pub struct Observations {
    /// By revision, ascending.
    targets: Vec<u64>,
    /// Scans that hold nothing any more, ascending.
    withdrawn: Vec<u64>,
    held: BTreeMap<VoxelKey, Held>,
    /// As they are without the targets.
    moments: BTreeMap<VoxelKey, Moments>,
    /// The voxels whose moments the targets changed.
    touched: BTreeSet<VoxelKey>,
}

/// Entries of a base that are taken over between two looks at the stop signal.
const ENTRIES_PER_LOOK: usize = 16 << 10;
/// What a tree takes for an entry besides the entry itself, a node of eleven of them being full; rounded up.
const OF_ENTRY: usize = 16;

#[derive(Debug, Clone, Copy, Default)]
struct Held {
    by_targets: BlockMask,
    by_others: BlockMask,
}

impl Observations {
    /// Begins with `base`, what the map held at a revision before that of any scan of `targets`; its holders are
    /// others; none once stopped. No scan may lie before the base and be withdrawn after it.
    pub fn new(
        mut targets: Vec<u64>,
        withdrawn: &[WithdrawnScan],
        base: &MapContents,
        stop: StopSignal<'_>,
    ) -> Option<Self> {
        targets.sort_unstable();
        let mut withdrawn: Vec<u64> = withdrawn.iter().map(|withdrawn| withdrawn.scan).collect();
        withdrawn.sort_unstable();
        let held = |&(block, by_others): &(VoxelKey, BlockMask)| {
            (block, Held { by_targets: BlockMask::EMPTY, by_others })
        };
        let looks = |entry: usize| !entry.is_multiple_of(ENTRIES_PER_LOOK) || !stop.is_stopped();
        let blocks = base.voxels.blocks().iter().enumerate().take_while(|(entry, _)| looks(*entry));
        let held = blocks.map(|(_, block)| held(block)).collect();
        let moments = base.moments.as_slice().iter().enumerate().take_while(|(entry, _)| looks(*entry));
        let moments = moments.map(|(_, moments)| *moments).collect();
        (!stop.is_stopped()).then(|| Self { targets, withdrawn, held, moments, touched: BTreeSet::new() })
    }

    /// Bytes that observations of a base of so many blocks and voxels with moments take, at most: each entry twice, since
    /// maps are sorted before they are built.
    pub fn bytes_max(blocks: usize, moments: usize) -> usize {
        const OF_BLOCK: usize = size_of::<(VoxelKey, Held)>();
        const OF_MOMENTS: usize = size_of::<(VoxelKey, Moments)>();
        let twice = |entry: usize| 2 * entry + OF_ENTRY;
        blocks.saturating_mul(twice(OF_BLOCK)).saturating_add(moments.saturating_mul(twice(OF_MOMENTS)))
    }

    /// The scans that are to be undone, by revision, ascending.
    pub fn targets(&self) -> &[u64] {
        &self.targets
    }

    /// Takes note of the next change after the base.
    pub fn observe(&mut self, revision: u64, change: &Change) {
        match change {
            Change::Insertion(_) if self.withdrawn.binary_search(&revision).is_ok() => {}
            Change::Insertion(scan) => {
                let is_target = self.targets.binary_search(&revision).is_ok();
                for (block, mask) in scan.voxels.blocks() {
                    let held = self.held.entry(*block).or_default();
                    let by = if is_target { &mut held.by_targets } else { &mut held.by_others };
                    *by = by.union(mask);
                }
                for &(voxel, moments) in scan.moments.as_slice() {
                    match is_target {
                        true => drop(self.touched.insert(voxel)),
                        false => *self.moments.entry(voxel).or_default() += moments,
                    }
                }
            }
            Change::Deletion(deletion) => {
                for (block, mask) in deletion.voxels.blocks() {
                    if let Some(Held { by_targets, by_others }) = self.held.get_mut(block) {
                        *by_targets = by_targets.difference(mask);
                        let before = std::mem::replace(by_others, by_others.difference(mask));
                        self.moments.extend(by_others.rebuilt_moments(&before, *block));
                    }
                }
            }
            // The scans that it took out were passed over where they went in.
            Change::Undo(_) => {}
        }
    }

    /// The moments of all voxels that the targets touched, as they are without them: what they were, and of no points
    /// where nothing is left.
    pub fn moments_without_targets(&self) -> MomentSet {
        let moments = |&voxel| (voxel, self.moments.get(&voxel).copied().unwrap_or_default());
        self.touched.iter().map(moments).collect()
    }

    /// The voxels that nobody but the targets holds.
    pub fn held_by_targets_alone(&self) -> VoxelSet {
        let alone = |(&block, held): (&VoxelKey, &Held)| (block, held.by_targets.difference(&held.by_others));
        self.held.iter().map(alone).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    fn base(side: i32) -> MapContents {
        let square = (0..side).flat_map(|x| (0..side).map(move |y| [x * 8, y * 8, 0]));
        MapContents::at(1, square.filter_map(VoxelKey::new).collect())
    }

    #[test]
    fn a_base_is_taken_over_with_looks_at_the_signal_in_proportion_to_its_size() {
        for side in [50, 200, 400] {
            let (base, looks) = (base(side), Cell::new(0));
            let count = || looks.replace(looks.get() + 1) == usize::MAX;
            assert!(Observations::new(vec![2], &[], &base, StopSignal::when(&count)).is_some());
            let entries = base.voxels.blocks().len() + base.moments.as_slice().len();
            assert!(entries / looks.get() <= ENTRIES_PER_LOOK, "{entries} entries, {} looks", looks.get());
        }
        let gone = || true;
        assert!(Observations::new(vec![2], &[], &base(50), StopSignal::when(&gone)).is_none());
    }

    #[test]
    fn what_is_reserved_for_a_base_covers_its_entries_twice() {
        let base = base(100);
        let (blocks, moments) = (base.voxels.blocks().len(), base.moments.as_slice().len());
        let entries = blocks * size_of::<(VoxelKey, Held)>() + moments * size_of::<(VoxelKey, Moments)>();
        let reserved = Observations::bytes_max(blocks, moments);
        assert!((2 * entries..3 * entries).contains(&reserved), "{reserved} for {entries} bytes of entries");
    }
}
