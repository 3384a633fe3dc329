//! Conversion between stored messages and domain types, both ways, for every message of `proto/mrol/store/v1`.
//!
//! Numbers are restored bit for bit. What cannot be read is described in a sentence; the caller adds file and offset.

mod change;
mod keep_out;
pub(crate) mod moments;
mod scan;
mod unreadable;
mod viewpoint;
pub(crate) mod voxels;

pub(crate) use scan::with_forgotten;
pub(crate) use unreadable::{Unreadable, required};
pub(crate) use viewpoint::{ascending_from, gaps_of};
pub(crate) use voxels::blocks_of;
