//! A hash of what a map holds, kept up at every commit.

use std::fmt;
use std::str::FromStr;

use crate::util::mixed;
use crate::voxel::{BlockMask, VoxelSet};

/// Hash of a set of finest voxels: equal for equal sets, whatever order their voxels came in.
///
/// It is the sum, modulo 2^64, of the mixed keys of the voxels, so that a change costs what it adds and takes out, and
/// a copy of a map compares itself with its original for nothing. A key is mixed by the output function of SplitMix64
/// (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014), all sums and products modulo
/// 2^64:
///
/// ```text
/// z = key + 0x9e3779b97f4a7c15
/// z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9
/// z = (z ^ z >> 27) * 0x94d049bb133111eb
/// z ^ z >> 31
/// ```
///
/// The empty set has 0. Two sets that differ by chance have the same hash once in 2^64; it is no guard against somebody
/// who looks for two that do.
///
/// ```
/// use mrol_map::map::ContentHash;
/// use mrol_map::voxel::{VoxelKey, VoxelSet};
///
/// let set: VoxelSet = [[0, 0, 0], [1, -2, 3]].into_iter().filter_map(VoxelKey::new).collect();
/// let hash = ContentHash::of(&set);
/// assert_eq!(hash.to_string().parse(), Ok(hash));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ContentHash(u64);

/// A revision of a map, and the hash of what it holds then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ContentVersion {
    /// Committed changes so far.
    pub revision: u64,
    /// Of the finest voxels.
    pub hash: ContentHash,
}

impl ContentHash {
    /// Of the finest voxels of a map.
    pub fn of(voxels: &VoxelSet) -> Self {
        let mut keys = Vec::with_capacity(512);
        voxels.blocks().iter().fold(Self::default(), |hash, (block, mask)| {
            keys.clear();
            BlockMask::EMPTY.keys_gained(mask, *block, 0, &mut keys);
            hash.with(Self::of_keys(&keys))
        })
    }

    /// Of the finest voxels with these keys.
    pub(super) fn of_keys(keys: &[u64]) -> Self {
        Self(keys.iter().fold(0, |sum, &key| sum.wrapping_add(mixed(key))))
    }

    /// Of this set and another one that shares no voxel with it.
    #[must_use]
    pub fn with(self, added: Self) -> Self {
        Self(self.0.wrapping_add(added.0))
    }

    /// Of this set without another one that is part of it.
    #[must_use]
    pub fn without(self, removed: Self) -> Self {
        Self(self.0.wrapping_sub(removed.0))
    }

    /// The hash as a number.
    pub fn to_bits(self) -> u64 {
        self.0
    }

    /// The hash that is this number.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }
}

/// Sixteen hexadecimal digits.
impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl FromStr for ContentHash {
    type Err = std::num::ParseIntError;

    fn from_str(digits: &str) -> Result<Self, Self::Err> {
        u64::from_str_radix(digits, 16).map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::VoxelKey;

    fn set(voxels: &[[i32; 3]]) -> VoxelSet {
        voxels.iter().filter_map(|&index| VoxelKey::new(index)).collect()
    }

    #[test]
    fn the_order_of_voxels_does_not_count_and_each_voxel_does() {
        let all = set(&[[0, 0, 0], [9, -1, 4], [7, 7, 7]]);
        assert_eq!(ContentHash::of(&all), ContentHash::of(&set(&[[7, 7, 7], [9, -1, 4], [0, 0, 0]])));
        assert_ne!(ContentHash::of(&all), ContentHash::of(&set(&[[0, 0, 0], [9, -1, 4]])));
        assert_eq!(ContentHash::of(&set(&[])), ContentHash::default());
        let parts = ContentHash::of(&set(&[[0, 0, 0]])).with(ContentHash::of(&set(&[[9, -1, 4], [7, 7, 7]])));
        assert_eq!(parts, ContentHash::of(&all));
        assert_eq!(
            parts.without(ContentHash::of(&set(&[[7, 7, 7]]))),
            ContentHash::of(&set(&[[0, 0, 0], [9, -1, 4]]))
        );
    }
}
