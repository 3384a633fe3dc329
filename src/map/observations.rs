//! Which voxels would not be there without certain scans.

use std::collections::BTreeMap;

use super::{Change, WithdrawnScan};
use crate::voxel::{BlockMask, VoxelKey, VoxelSet};

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
}

#[derive(Debug, Clone, Copy, Default)]
struct Held {
    by_targets: BlockMask,
    by_others: BlockMask,
}

impl Observations {
    /// Begins with `base`, the finest voxels at a revision before that of any scan of `targets`; its holders are
    /// others. No scan may lie before the base and be withdrawn after it.
    pub fn new(mut targets: Vec<u64>, withdrawn: &[WithdrawnScan], base: &VoxelSet) -> Self {
        targets.sort_unstable();
        let mut withdrawn: Vec<u64> = withdrawn.iter().map(|withdrawn| withdrawn.scan).collect();
        withdrawn.sort_unstable();
        let held = |&(block, by_others): &(VoxelKey, BlockMask)| {
            (block, Held { by_targets: BlockMask::EMPTY, by_others })
        };
        Self { targets, withdrawn, held: base.blocks().iter().map(held).collect() }
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
            }
            Change::Deletion(deletion) => {
                for (block, mask) in deletion.voxels.blocks() {
                    if let Some(Held { by_targets, by_others }) = self.held.get_mut(block) {
                        *by_targets = by_targets.difference(mask);
                        *by_others = by_others.difference(mask);
                    }
                }
            }
            // The scans that it took out were passed over where they went in.
            Change::Undo(_) => {}
        }
    }

    /// The voxels that nobody but the targets holds.
    pub fn held_by_targets_alone(&self) -> VoxelSet {
        let alone = |(&block, held): (&VoxelKey, &Held)| (block, held.by_targets.difference(&held.by_others));
        self.held.iter().map(alone).collect()
    }
}
