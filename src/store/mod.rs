//! Maps on disk: nothing that was acknowledged is lost.
//!
//! Every change of a map is a record in its *journal* before anybody sees it; *snapshots* of the whole map are
//! written now and then beside the running server, so that starting takes the newest of them and the journal after
//! it. Reading order: [`DataDir`] is the folder of a server, [`MapFolder`] that of a map, [`Snapshot`] and
//! [`Journal`] the files in it, [`FileSystem`] what they ask of the system.
//!
//! What is promised:
//!
//! * With [`Durability::Always`] a change that was acknowledged is there after a crash at any moment, loss of power
//!   included; with an interval, after the end of the process at any moment.
//! * After a start the map is that of one revision, and nothing is half applied.
//! * An end of the journal that had never been written to its end is cut off, and reported. Everything else that
//!   cannot be read is an error that names file, offset and what helps; nothing is skipped in silence.
//! * When the journal cannot be written or synced, the map takes no more changes, and is read all the same. A sync is
//!   never asked for again after it failed.
//!
//! Byte layouts: `snapshot.rs`, `journal/segment.rs`, `journal/frame.rs`, `proto/mrol/store/v1`.

mod checked_files;
mod codec;
mod data_dir;
pub mod doctor;
mod entry;
mod error;
mod file_system;
mod folder;
mod journal;
mod map_folder;
mod mode;
mod pb;
mod progress;
mod replacement;
mod retention;
mod settings;
mod snapshot;
mod snapshot_files;

pub use data_dir::{DataDir, DataDirContents};
pub use error::StoreError;
pub use file_system::{Appending, Disk, FileSystem};
pub use journal::{
    Changes, Cut, JOURNAL_VERSION, Journal, JournalUse, RECORD_BYTES_MAX, Record, Recovered, Revised,
    SegmentedJournal,
};
pub use map_folder::{FolderUse, MapFolder, NotObserved, Observed, OpenedMap, Pin};
pub use mode::{StoreMode, StoreModeError};
pub use progress::{Opened, OpeningProgress};
pub use settings::{Durability, DurabilityError, StoreSettings};
pub(crate) use snapshot::body_bytes;
pub use snapshot::{FORMAT_VERSION, MapFileError, MapFileLimits, Snapshot};
