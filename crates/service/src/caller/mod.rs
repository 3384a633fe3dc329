//! The maps and the scans that a caller may name.

mod allowed_maps;
mod allowed_scans;

pub use allowed_maps::AllowedMaps;
pub(crate) use allowed_maps::Reachable;
pub use allowed_scans::AllowedScans;
