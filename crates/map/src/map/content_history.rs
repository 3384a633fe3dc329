//! The content hashes of a map's last revisions.

use std::collections::VecDeque;

use super::content_hash::{ContentHash, ContentVersion};

/// The content hashes of consecutive revisions of a map, up to its newest: by them it is known whether somebody else's
/// copy of an older revision is of this history, or of one that was lost when an older data folder was put back.
///
/// It holds at most [`Self::REVISIONS_MAX`] revisions, 8 bytes each; the oldest go first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContentHistory {
    first: u64,
    hashes: VecDeque<ContentHash>,
}

impl ContentHistory {
    /// Most revisions whose hashes are kept: half a megabyte.
    pub const REVISIONS_MAX: usize = 1 << 16;

    /// The history that begins with this version.
    pub fn of(version: ContentVersion) -> Self {
        Self { first: version.revision, hashes: VecDeque::from([version.hash]) }
    }

    /// Adds the next version. One that does not follow the last begins a new history.
    pub fn push(&mut self, version: ContentVersion) {
        if version.revision != self.first + self.hashes.len() as u64 {
            *self = Self::of(version);
            return;
        }
        self.hashes.push_back(version.hash);
        if self.hashes.len() > Self::REVISIONS_MAX {
            self.hashes.pop_front();
            self.first += 1;
        }
    }

    /// The content hash at `revision`; none where it is not known.
    pub fn get(&self, revision: u64) -> Option<ContentHash> {
        let at = usize::try_from(revision.checked_sub(self.first)?).ok()?;
        self.hashes.get(at).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(revision: u64) -> ContentVersion {
        ContentVersion { revision, hash: ContentHash::from_bits(100 + revision) }
    }

    #[test]
    fn the_last_revisions_are_known_and_no_others() {
        let mut history = ContentHistory::of(version(7));
        let last = 7 + ContentHistory::REVISIONS_MAX as u64;
        (8..=last).for_each(|revision| history.push(version(revision)));
        assert_eq!([7, last + 1].map(|revision| history.get(revision)), [None; 2]);
        for revision in [8, 9, last] {
            assert_eq!(history.get(revision), Some(version(revision).hash), "{revision}");
        }
    }

    #[test]
    fn a_version_that_does_not_follow_begins_a_new_history() {
        let mut history = ContentHistory::of(version(7));
        history.push(version(9));
        assert_eq!([7, 8].map(|revision| history.get(revision)), [None; 2]);
        assert_eq!(history.get(9), Some(version(9).hash));
    }
}
