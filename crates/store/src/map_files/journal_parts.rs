//! Reads the journal: backwards, a segment at a time, or from a revision on.

use super::map_folder::MapFolder;
use crate::error::StoreError;
use crate::journal::StoredRecords;

/// Consecutive changes of the journal that lie in one segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JournalPart {
    /// The revision of the first.
    pub first: u64,
    /// The revision of the last; none is there where that is before the first.
    pub last: u64,
}

impl MapFolder {
    /// The parts of the journal up to revision `head`, the newest first, as far back as they are kept.
    pub fn journal_parts(&self, head: u64) -> Vec<JournalPart> {
        let (segments, _) = self.facts.journal();
        let ends = segments.iter().skip(1).map(|next| next - 1).chain([head]);
        let parts = segments.iter().zip(ends).map(|(&first, end)| JournalPart { first, last: end.min(head) });
        let parts: Vec<_> = parts.filter(|part| part.first <= part.last).collect();
        parts.into_iter().rev().collect()
    }

    /// Bytes of the segment that a part lies in, which is read as a whole.
    ///
    /// # Errors
    /// When the system refuses, or the segment was removed meanwhile.
    pub fn bytes_of_part(&self, part: &JournalPart) -> Result<u64, StoreError> {
        self.place.bytes(part.first)
    }

    /// Reads the records of a part, ascending.
    pub fn records_of_part(&self, part: &JournalPart) -> StoredRecords {
        self.place.records_of(part.first, part.first, part.last)
    }

    /// Reads the records from `revision` on, ascending; a revision that is no longer kept is an error.
    pub fn records_from(&self, revision: u64) -> StoredRecords {
        let (segments, head) = self.facts.journal();
        self.place.records_from(revision, &segments, head)
    }

    /// False once the segment of a part is not kept any more.
    pub fn keeps_part(&self, part: &JournalPart) -> bool {
        self.facts.journal().0.contains(&part.first)
    }
}
