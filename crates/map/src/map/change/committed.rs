//! What a change that was made came to.

use crate::map::content_hash::{ContentHash, ContentVersion};

/// A change that was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Committed {
    /// The revision after it.
    pub revision: u64,
    /// Hash of what the map holds after it.
    pub hash: ContentHash,
    /// Finest voxels that it added.
    pub added: usize,
    /// Finest voxels that it took out.
    pub removed: usize,
}

impl Committed {
    /// The revision after the change, with its hash.
    pub fn version(&self) -> ContentVersion {
        ContentVersion { revision: self.revision, hash: self.hash }
    }

    /// No change of a map at `version`.
    pub fn none(ContentVersion { revision, hash }: ContentVersion) -> Self {
        Self { revision, hash, added: 0, removed: 0 }
    }
}
