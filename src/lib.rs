//! A networked multi-resolution voxel map: Ryde and Corso, *Fast Voxel Maps with Counting Bloom Filters*
//! (IROS 2012), as a server.

pub mod align;
pub mod bloom;
pub mod geometry;
pub mod map;
pub mod scan;
#[cfg(feature = "client")]
pub mod service;
#[cfg(feature = "client")]
pub mod store;
pub mod voxel;
