//! What is kept of a map: through `kill -9`, on disks that fail, across restarts, from former releases, and through
//! undo.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod crash;
mod data_folders;
mod failing_disk;
mod operators;
mod store_history;
#[path = "../support/mod.rs"]
mod support;
mod undo;
