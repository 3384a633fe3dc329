//! The viewpoints of a map: where scans were taken and how far each saw, with an index of what each covers.

mod coverage;
mod newly_seen;
mod viewpoint;
mod viewpoint_set;

pub use newly_seen::{newly_seen_by_rays_m3, newly_seen_m3};
pub use viewpoint::{VIEWPOINT_MEMORY_MAX, Viewpoint};
pub use viewpoint_set::{ViewpointCache, ViewpointSet};
