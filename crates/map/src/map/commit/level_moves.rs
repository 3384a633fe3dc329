//! Which voxels of a level go and come.

use crate::map::change::KeysOfLevel;
use crate::map::shards::tier_of;
use crate::voxel::{BlockMask, VoxelKey};

/// The voxels of a level that go, and those that come: their keys, or only how many more there are.
#[derive(Debug)]
pub(super) struct LevelMoves {
    level: usize,
    moved: Moved,
}

#[derive(Debug)]
enum Moved {
    Keys { lost: Vec<u64>, gained: Vec<u64> },
    Count { lost: usize, gained: usize },
}

impl LevelMoves {
    /// None yet; where somebody needs the keys, they are kept.
    pub(super) fn none(level: usize, keeps_keys: bool) -> Self {
        let moved = match keeps_keys {
            true => Moved::Keys { lost: Vec::new(), gained: Vec::new() },
            false => Moved::Count { lost: 0, gained: 0 },
        };
        Self { level, moved }
    }

    /// Which level.
    pub(super) fn level(&self) -> usize {
        self.level
    }

    /// Takes note of a block that has become `after`, and of what it lost where it `loses` voxels.
    pub(super) fn note(&mut self, block: VoxelKey, before: &BlockMask, after: &BlockMask, loses: bool) {
        let (_, up) = tier_of(self.level as u32);
        match &mut self.moved {
            Moved::Keys { lost, gained } => {
                before.keys_gained(after, block, up, gained);
                // What is gone is what would be gained if all came back.
                loses.then(|| after.keys_gained(before, block, up, lost));
            }
            Moved::Count { lost, gained } => {
                *lost += before.count(up);
                *gained += after.count(up);
            }
        }
    }

    /// The number of the level's voxels, of which there were `before`.
    pub(super) fn voxels_after(&self, before: usize) -> usize {
        match &self.moved {
            Moved::Keys { lost, gained } => before + gained.len() - lost.len(),
            Moved::Count { lost, gained } => before + gained - lost,
        }
    }

    /// The keys that go and those that come; none where they are not kept.
    pub(super) fn keys(&self) -> (&[u64], &[u64]) {
        match &self.moved {
            Moved::Keys { lost, gained } => (lost, gained),
            Moved::Count { .. } => (&[], &[]),
        }
    }

    /// [`LevelMoves::keys`], without a copy.
    pub(super) fn into_keys(self) -> (Vec<u64>, Vec<u64>) {
        match self.moved {
            Moved::Keys { lost, gained } => (lost, gained),
            Moved::Count { .. } => (Vec::new(), Vec::new()),
        }
    }

    /// The keys, copied for the watchers of the level.
    pub(super) fn to_keys_of_level(&self) -> KeysOfLevel {
        let (lost, gained) = self.keys();
        KeysOfLevel { level: self.level as u32, lost: lost.to_vec(), gained: gained.to_vec() }
    }
}
