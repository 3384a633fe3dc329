//! The data folder, where a server keeps its maps.
//!
//! ```text
//! DATA_DIR/lock                   held by the one process that uses the folder
//! DATA_DIR/node                   the node of a cluster that the folder belongs to; not there of a server by itself
//! DATA_DIR/maps/NAME.UUID/        a map, see `map_files`
//! DATA_DIR/maps/NAME/             a map of a former release: gets its uuid when it is opened
//! DATA_DIR/maps/NAME.UUID.damaged/   a map whose files are damaged, set aside by `mrol doctor`: read by nobody
//! DATA_DIR/maps/NAME.mrol         a map file (of version 1, a backup, of `mrol map --out`): taken in at a start where
//!                                 there is no map of the name; where there is one, it stays and is reported
//! DATA_DIR/maps/.unfinished-...   what a crash left: swept away
//! ```
//!
//! The folder *is* the catalog. A map's name and uuid are its folder's; its settings are in each of its snapshots. That
//! a map is made, renamed or deleted is one rename of its folder, which is atomic, so there is no second store that
//! could disagree with the files, and nothing to repair between the two. Likewise requests: which scans and deletions
//! were accepted is part of the changes themselves, durable in the same record.
//!
//! The uuid in the folder's name keeps maps of one name apart: whatever is still written for a map that was deleted
//! goes into its own folder, and never into that of the next map of its name.

mod contents;
mod data_dir;
mod leaving;
mod node_mark;

pub use contents::DataDirContents;
pub use data_dir::DataDir;
pub use leaving::LeftMap;
