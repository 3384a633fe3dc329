//! Operations on maps as a whole: they are made, described, listed, deleted and saved, as map files too, and shared
//! with other nodes.

mod in_cluster;
mod map_file;
mod operations;
mod sharing;

pub use sharing::SharedMap;

#[cfg(test)]
pub(crate) use map_file::from_file;
