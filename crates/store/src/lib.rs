//! Maps on disk: nothing that was acknowledged is lost.
//!
//! Every change of a map is a record in its *journal* before it is visible. *Snapshots* of the whole map are written
//! now and then while the server runs, so that a start reads the newest snapshot and the journal after it. Reading
//! order: [`DataDir`] is the folder of a server, [`MapFolder`] that of a map, [`Snapshot`] and [`SegmentedJournal`] the
//! files in it, [`FileSystem`] the operations that they need.
//!
//! Guarantees, after `kill -9` of the server, a crash of the machine, or a loss of power:
//!
//! * With [`Durability::Always`], the default, every acknowledged change is there afterwards. With
//!   [`Durability::Interval`] that holds after the end of the process; a loss of power takes the last interval.
//! * After a start the map is that of one revision; no change is applied in part.
//! * A torn end of the journal, which was never written completely, is cut off and reported. Everything else that
//!   cannot be read is an error that names the file, the offset and the remedy; nothing is skipped silently.
//! * When the journal cannot be written or synced, the map accepts no more changes, and can still be read. A sync is
//!   not repeated after it failed.
//!
//! Byte layouts: `snapshots/mod.rs`, `viewpoint_parts/file.rs`, `journal/segment.rs`, `journal/frame.rs`,
//! `proto/mrol/store/v1`.

mod checked_files;
mod codec;
mod compression;
mod data_folder;
pub mod doctor;
mod entry;
mod error;
mod file_system;
mod folder;
mod journal;
mod map_files;
mod mode;
mod pb;
mod progress;
mod replacement;
mod settings;
mod snapshots;
mod viewpoint_parts;

pub use data_folder::{DataDir, DataDirContents, LeftMap};
pub use error::StoreError;
pub use file_system::{Appending, Disk, FileSystem};
pub use journal::{
    Changes, Cut, JOURNAL_VERSION, JournalUse, RECORD_BYTES_MAX, ReceivedRecord, Record, Recovered, Revised,
    SegmentedJournal, StoredRecord, StoredRecords, VoxelMention, frames_of, read_frames,
};
pub use map_files::{
    FolderUse, JournalPart, MapFolder, NotObserved, Observed, OpenedMap, Pin, check_replayed,
};
pub use mode::{StoreMode, StoreModeError};
pub use progress::{Opened, OpeningProgress};
pub use settings::{Durability, DurabilityError, StoreSettings};
pub use snapshots::{FORMAT_VERSION, MapFileError, MapFileLimits, Snapshot, body_bytes};
