//! The operations by HTTP: a file for each group of routes.

pub(super) mod block;
pub(super) mod deletions;
pub(super) mod events;
pub(super) mod keep_outs;
pub(super) mod localization;
pub(super) mod map_file;
pub(super) mod maps;
pub(super) mod observers;
pub(super) mod occupancy;
pub(super) mod scans;
pub(super) mod trajectory;
pub(super) mod undo;
pub(super) mod voxels;
pub(super) mod watch;

pub(crate) use maps::UnavailableResponse;
