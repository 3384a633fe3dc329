//! What is read of a journal.

use super::mention::StoredRecord;
use crate::error::StoreError;
use mrol_map::map::Change;

/// A change with the revision that it made.
pub type Revised = (u64, Change);
/// Iterator of changes in the order of their revisions, read on demand.
pub type Changes = Box<dyn Iterator<Item = Result<Revised, StoreError>> + Send>;

/// Iterator of records in the order of their revisions, read on demand.
pub type StoredRecords = Box<dyn Iterator<Item = Result<(u64, StoredRecord), StoreError>> + Send>;
