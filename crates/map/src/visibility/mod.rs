//! Visibility: where scans looked through (paper III-B).
//!
//! The paper stores no free space and generates it on demand from the recorded poses and a sensor model. Here the model
//! is what the sensor saw: a scan that sees something new leaves a [`Viewpoint`], its pose with a small [`RangeImage`]
//! of how far it saw in each direction. A voxel is free where a viewpoint saw through its center and nothing occupies
//! it.

mod coverage;
mod cube_map;
mod density;
mod image_bytes;
mod image_layout;
mod nearest_depths;
mod newly_seen;
mod range_image;
mod ray_gaps;
mod ray_index;
mod scan_image;
mod scan_rays;
mod scan_surface;
mod set;
mod sight;
mod sweep;
#[cfg(test)]
mod tests;
mod tile;
mod vectors;
mod viewpoint;

pub use image_bytes::RangeImageError;
pub use newly_seen::{newly_seen_by_rays_m3, newly_seen_m3};
pub use range_image::{AbsenceEvidence, IMAGE_BYTES_MAX, Met, RangeImage};
pub use ray_index::RayWindow;
pub use scan_image::ScanImage;
pub use scan_rays::ScanRays;
pub use scan_surface::{ScanSurface, SurfaceSettings};
pub use set::{ViewpointCache, ViewpointSet};
pub use sight::Sight;
pub use sweep::Sweep;
pub use viewpoint::{VIEWPOINT_MEMORY_MAX, Viewpoint};
