//! What is kept of a map: on disks that fail, across restarts, from former releases, and through undo.

#![cfg(feature = "client")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

#[cfg(feature = "server")]
mod data_folders;
mod failing_disk;
#[cfg(feature = "server")]
mod operators;
mod store_history;
#[path = "../support/mod.rs"]
mod support;
#[cfg(feature = "server")]
mod undo;
