//! Conversion between stored messages and domain types, both ways, for every message of `proto/mrol/store/v1`.
//!
//! Numbers are restored bit for bit. What cannot be read is described in a sentence; the caller adds file and offset.

mod change;
mod keep_out;
pub(super) mod moments;
mod scan;
mod unreadable;
mod viewpoint;
pub(super) mod voxels;

pub(super) use scan::with_forgotten;
pub(super) use unreadable::{Unreadable, required};
pub(super) use viewpoint::{ascending_from, gaps_of};
