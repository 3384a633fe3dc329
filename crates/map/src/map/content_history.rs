//! The hashes of a map's last revisions.

use std::collections::VecDeque;

use super::content_hash::{ContentHash, ContentVersion};
use super::state_hash::StateHash;

/// The hashes of a map at one revision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RevisionHashes {
    /// Of the finest voxels.
    pub content: ContentHash,
    /// Of all that a copy may hold.
    pub state: StateHash,
}

/// The hashes of consecutive revisions of a map, up to its newest: by them it is known whether somebody else's
/// copy of an older revision is of this history, or of one that was lost when an older data folder was put back.
///
/// It holds at most [`Self::REVISIONS_MAX`] revisions, 16 bytes each; the oldest go first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContentHistory {
    first: u64,
    hashes: VecDeque<RevisionHashes>,
}

impl ContentHistory {
    /// Most revisions whose hashes are kept: one megabyte.
    pub const REVISIONS_MAX: usize = 1 << 16;

    /// The history that begins with this version, in which all that a copy may hold has the hash `state`.
    pub fn of(ContentVersion { revision, hash: content }: ContentVersion, state: StateHash) -> Self {
        Self { first: revision, hashes: VecDeque::from([RevisionHashes { content, state }]) }
    }

    /// Adds the next version. One that does not follow the last begins a new history.
    pub fn push(&mut self, version: ContentVersion, state: StateHash) {
        if version.revision != self.first + self.hashes.len() as u64 {
            *self = Self::of(version, state);
            return;
        }
        self.hashes.push_back(RevisionHashes { content: version.hash, state });
        if self.hashes.len() > Self::REVISIONS_MAX {
            self.hashes.pop_front();
            self.first += 1;
        }
    }

    /// The hashes at `revision`; none where they are not known.
    pub fn get(&self, revision: u64) -> Option<RevisionHashes> {
        let at = usize::try_from(revision.checked_sub(self.first)?).ok()?;
        self.hashes.get(at).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(revision: u64) -> (ContentVersion, StateHash) {
        let hash = ContentHash::from_bits(100 + revision);
        (ContentVersion { revision, hash }, StateHash::from_bits(200 + revision))
    }

    fn history_of(revision: u64) -> ContentHistory {
        let (version, state) = version(revision);
        ContentHistory::of(version, state)
    }

    fn push(history: &mut ContentHistory, revision: u64) {
        let (version, state) = version(revision);
        history.push(version, state);
    }

    fn hashes(revision: u64) -> Option<RevisionHashes> {
        let (version, state) = version(revision);
        Some(RevisionHashes { content: version.hash, state })
    }

    #[test]
    fn the_last_revisions_are_known_and_no_others() {
        let mut history = history_of(7);
        let last = 7 + ContentHistory::REVISIONS_MAX as u64;
        (8..=last).for_each(|revision| push(&mut history, revision));
        assert_eq!([7, last + 1].map(|revision| history.get(revision)), [None; 2]);
        for revision in [8, 9, last] {
            assert_eq!(history.get(revision), hashes(revision), "{revision}");
        }
    }

    #[test]
    fn a_version_that_does_not_follow_begins_a_new_history() {
        let mut history = history_of(7);
        push(&mut history, 9);
        assert_eq!([7, 8].map(|revision| history.get(revision)), [None; 2]);
        assert_eq!(history.get(9), hashes(9));
    }
}
