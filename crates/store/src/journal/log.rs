//! The trait of journals, and what they read.

use super::mention::StoredRecord;
use super::record::Record;
use crate::error::StoreError;
use mrol_map::map::Change;

/// A change with the revision that it made.
pub type Revised = (u64, Change);
/// Iterator of changes in the order of their revisions, read on demand.
pub type Changes = Box<dyn Iterator<Item = Result<Revised, StoreError>> + Send>;

/// Iterator of records in the order of their revisions, read on demand.
pub type StoredRecords = Box<dyn Iterator<Item = Result<(u64, StoredRecord), StoreError>> + Send>;

/// A log of changes. The sequence numbers are the map's revisions: 1, 2, 3, ...
pub trait Journal: std::fmt::Debug + Send {
    /// Appends records, which get the revisions after the head, and returns the new head. They are durable after the
    /// next [`Journal::sync`], so that one sync serves all waiters.
    ///
    /// # Errors
    /// When they cannot be written. The journal then accepts nothing more.
    fn append(&mut self, records: &[&Record]) -> Result<u64, StoreError>;

    /// Makes everything appended so far durable.
    ///
    /// # Errors
    /// When that is not certain. The journal then accepts nothing more and is not synced again: the system may have
    /// dropped what it could not write.
    fn sync(&mut self) -> Result<(), StoreError>;

    /// Returns the last revision that was appended.
    fn head(&self) -> u64;

    /// Reads the changes from `revision` to the present head; a revision that was removed is an error.
    fn read_from(&self, revision: u64) -> Changes;

    /// Removes changes before `revision`, as far as that is cheap.
    ///
    /// # Errors
    /// When the system refuses; nothing else is removed then.
    fn truncate_before(&mut self, revision: u64) -> Result<(), StoreError>;
}
