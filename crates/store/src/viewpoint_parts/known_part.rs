//! A part that is known to lie in a map's folder.

use super::file::ViewpointPart;

/// A part that lies in the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct KnownPart {
    pub(super) number: u64,
    pub(super) checksum: u32,
    /// Revisions and bytes of the images of all that is in it, ascending.
    pub(crate) stored: Vec<(u64, u32)>,
}

impl KnownPart {
    /// The part `number` of that content.
    pub(super) fn of(number: u64, part: &ViewpointPart) -> Self {
        let stored = part.viewpoints.iter();
        let stored = stored.map(|(revision, it)| (*revision, it.image().stored_bytes() as u32)).collect();
        Self { number, checksum: part.checksum, stored }
    }

    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    pub(super) fn has(&self, revision: u64) -> bool {
        self.stored.binary_search_by_key(&revision, |(revision, _)| *revision).is_ok()
    }

    pub(super) fn revisions(&self) -> impl Iterator<Item = u64> {
        self.stored.iter().map(|(revision, _)| *revision)
    }

    pub(super) fn bytes(&self) -> u64 {
        self.stored.iter().map(|(_, bytes)| u64::from(*bytes)).sum()
    }
}
