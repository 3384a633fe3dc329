//! Where a map's folder keeps the viewpoints of its scans: in parts, so that a snapshot does not write all of them
//! again.
//!
//! ```text
//! office.UUID/viewpoints-00000000000000000001.part    those of the scans up to the first snapshot
//! office.UUID/viewpoints-00000000000000000001.copy    the same once more
//! office.UUID/viewpoints-00000000000000000002.part    those since
//! office.UUID/viewpoints-00000000000000000002.copy
//! office.UUID/snapshot-00000000000000004711.mrol      names parts, and which viewpoints of each the map has
//! ```
//!
//! A part is written once, before the snapshot that first names it, under a number that no part had before; it goes
//! when no snapshot names it any more. Viewpoints that went stay in their part until most of it is of no use; what is
//! left of it is then written again with those that are new. So are small parts, so that there are few.
//!
//! Each part has a copy. Snapshots stand in for each other where one is damaged, but they share their parts: without a
//! copy one bad sector of an old part would keep the map from being opened.

mod file;
mod known_part;
mod loading;
mod plan;
#[cfg(test)]
mod tests;
mod uses;

pub(crate) use file::{PART_HEADER_BYTES, owner_of_part, part_names, part_number};
pub(crate) use loading::{LoadedParts, bytes_of, load, load_readable, numbers_in};
pub(crate) use plan::ViewpointParts;
pub(crate) use uses::{PartUse, section_of, uses_in};
