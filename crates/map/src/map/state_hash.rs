//! A hash of all that a copy of a map may hold.

use std::fmt;

use super::content_hash::ContentHash;
use super::multi_resolution_map::MultiResolutionMap;
use crate::util::Digest;

/// Hash of all that a copy of a map may hold: finest voxels, keep-outs and viewpoints. Equal where all of these are
/// equal.
///
/// It tells whether a copy of a revision is of the history that a server has, or of one that was lost when an older
/// data folder was put back. A copy does not compute it: it keeps what it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StateHash(u64);

impl StateHash {
    /// Of voxels with this hash, and of keep-outs and viewpoints with these.
    fn of(voxels: ContentHash, keep_outs: u64, viewpoints: u64) -> Self {
        Self(Digest::default().word(voxels.to_bits()).word(keep_outs).word(viewpoints).finish())
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
impl fmt::Display for StateHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl MultiResolutionMap {
    /// The hash of all that a copy of the map may hold now. To be called by the maker of its changes: what it reads is
    /// of one revision only while nobody makes another.
    pub fn state_hash(&self) -> StateHash {
        StateHash::of(self.content_version().hash, self.keep_outs().hash(), self.viewpoints().hash())
    }
}
