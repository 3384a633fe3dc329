//! The journal of a map: its changes in the order of their revisions, durable before they are visible.
//!
//! Reading order: `record` is a change as bytes, `frame` a record in a file, `segment` a file, `segmented` all files,
//! `recovery` reads them after a crash; `received` are records on their way between nodes that share a map.

mod frame;
mod inspection;
mod mention;
mod reading;
mod received;
mod record;
mod recovery;
mod segment;
mod segmented;

pub(crate) use inspection::{Inspected, inspect};
pub use mention::{StoredRecord, VoxelMention};
pub use reading::{Changes, Revised, StoredRecords};
pub use received::{ReceivedRecord, frames_of, read_frames};
pub use record::{RECORD_BYTES_MAX, Record};
pub(crate) use recovery::Known;
pub use recovery::{Cut, Recovered};
pub use segment::JOURNAL_VERSION;
pub(crate) use segment::{HEADER_BYTES as SEGMENT_HEADER_BYTES, first_revision, owner as owner_of_segment};
pub(crate) use segmented::SegmentFolder;
pub use segmented::{JournalUse, SegmentedJournal};
