//! The folder of one map: snapshots, and the journal that continues from them.
//!
//! ```text
//! office.UUID/snapshot-00000000000000000000.mrol      at that revision
//! office.UUID/snapshot-00000000000000004711.mrol
//! office.UUID/journal-00000000000000000001.log        from that revision on
//! office.UUID/journal-00000000000000004712.log
//! office.UUID/viewpoints-00000000000000000003.part    see `viewpoint_parts`
//! ```
//!
//! Two locks are held while files are written, one for the snapshots and one for the journal; only writers wait for
//! them. What readers ask is in `facts`.

mod facts;
mod journal_parts;
mod map_folder;
mod observing;
mod opening;
mod retention;
mod snapshot_files;

pub use facts::{FolderUse, Pin};
pub use journal_parts::JournalPart;
pub use map_folder::MapFolder;
pub use observing::{NotObserved, Observed};
pub use opening::{OpenedMap, check_replayed};
pub(crate) use snapshot_files::{
    bytes_to_read, newest_good, not_understood, set_aside_in, snapshot_name, snapshot_revisions,
};
