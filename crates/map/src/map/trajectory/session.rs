//! The scan ids of one session of a robot.

use super::chunked::Chunked;
use super::id_ranges::IdRanges;

/// The ids of one session's scans.
#[derive(Debug, Clone, Default)]
pub(super) struct Session {
    /// Ids of accepted scans whose poses are stored, with the revisions that they made. Scans that were undone are
    /// among them.
    ids: Chunked<(u64, u64)>,
    /// Ids of accepted scans whose poses are not stored any more.
    forgotten: IdRanges,
    /// The last revision that a scan of the session made.
    pub(super) last_revision: u64,
}

impl Session {
    /// A session of which no scan is stored.
    pub(super) fn of_forgotten(ranges: impl IntoIterator<Item = (u64, u64)>, last_revision: u64) -> Self {
        let mut forgotten = IdRanges::default();
        ranges.into_iter().for_each(|(first, last)| forgotten.insert(first, last));
        Self { forgotten, last_revision, ..Self::default() }
    }

    pub(super) fn push(&mut self, id: u64, revision: u64) {
        self.ids.insert((id, revision));
        self.last_revision = self.last_revision.max(revision);
    }

    /// The revision of the scan of that id.
    pub(super) fn find(&self, id: u64) -> Option<u64> {
        self.ids.get(id).map(|&(_, revision)| revision)
    }

    pub(super) fn has_forgotten(&self, id: u64) -> bool {
        self.forgotten.contains(id)
    }

    pub(super) fn forgotten(&self) -> &[(u64, u64)] {
        self.forgotten.as_slice()
    }

    /// Forgets the scans with these ids and revisions: their ids alone stay. An id that a later scan has is not
    /// forgotten.
    pub(super) fn forget(&mut self, scans: &[(u64, u64)]) {
        let is_of = |&&(id, revision): &&(u64, u64)| self.find(id) == Some(revision);
        let mut ids: Vec<u64> = scans.iter().filter(is_of).map(|&(id, _)| id).collect();
        ids.sort_unstable();
        self.ids.remove_all(&ids);
        ids.into_iter().for_each(|id| self.forgotten.insert(id, id));
    }

    pub(super) fn bytes(&self) -> usize {
        self.ids.bytes() + self.forgotten.bytes()
    }
}
