//! The journal of a map: its changes in the order of their revisions, durable before they are visible.
//!
//! [`Journal`] is a narrow trait, so that a replicated log can take the place of [`SegmentedJournal`], which is files
//! on this machine. Reading order: `log` is the trait, `record` a change as bytes, `frame` a record in a file,
//! `segment` a file, `segmented` all files, `recovery` reads them after a crash.

mod frame;
mod inspection;
mod log;
mod mention;
mod record;
mod recovery;
mod segment;
mod segmented;

pub(crate) use inspection::{Inspected, inspect};
pub use log::{Changes, Journal, Revised, StoredRecords};
pub use mention::{StoredRecord, VoxelMention};
pub use record::{RECORD_BYTES_MAX, Record};
pub(crate) use recovery::Known;
pub use recovery::{Cut, Recovered};
pub use segment::JOURNAL_VERSION;
pub(crate) use segment::{HEADER_BYTES as SEGMENT_HEADER_BYTES, first_revision, owner as owner_of_segment};
pub(crate) use segmented::SegmentFolder;
pub use segmented::{JournalUse, SegmentedJournal};
