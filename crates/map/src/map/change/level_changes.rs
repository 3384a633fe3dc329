//! What a change does to chosen levels, for their watchers.

use crate::voxel::{VoxelKey, VoxelSet};

/// A set of levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelSet(u32);

/// The voxels of one level that a change made appear, and those that went with it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LevelChange {
    /// The level.
    pub level: u32,
    /// Voxels that were occupied before, and are not any more.
    pub removed: VoxelSet,
    /// Voxels that were not occupied before.
    pub added: VoxelSet,
}

impl LevelSet {
    /// True where `level` is one of them.
    pub fn contains(self, level: u32) -> bool {
        self.0 >> level & 1 == 1
    }

    /// The levels, ascending.
    pub fn iter(self) -> impl Iterator<Item = u32> {
        (0..u32::BITS).filter(move |&level| self.contains(level))
    }
}

impl FromIterator<u32> for LevelSet {
    fn from_iter<I: IntoIterator<Item = u32>>(levels: I) -> Self {
        Self(levels.into_iter().filter(|level| *level < u32::BITS).fold(0, |set, level| set | 1 << level))
    }
}

/// Packed keys of one level that went and came, as they are found shard by shard.
#[derive(Debug, Default)]
pub(in crate::map) struct KeysOfLevel {
    pub(in crate::map) level: u32,
    pub(in crate::map) lost: Vec<u64>,
    pub(in crate::map) gained: Vec<u64>,
}

impl LevelChange {
    /// What the parts of all shards come to, level by level.
    pub(in crate::map) fn of(levels: LevelSet, parts: impl IntoIterator<Item = KeysOfLevel>) -> Vec<Self> {
        let mut all: Vec<KeysOfLevel> =
            levels.iter().map(|level| KeysOfLevel { level, ..KeysOfLevel::default() }).collect();
        for part in parts {
            if let Some(of_level) = all.iter_mut().find(|of_level| of_level.level == part.level) {
                of_level.lost.extend(part.lost);
                of_level.gained.extend(part.gained);
            }
        }
        let set = |keys: Vec<u64>| keys.into_iter().filter_map(VoxelKey::from_bits).collect();
        let change =
            |KeysOfLevel { level, lost, gained }| Self { level, removed: set(lost), added: set(gained) };
        all.into_iter().map(change).collect()
    }
}
