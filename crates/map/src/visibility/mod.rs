//! Visibility: where scans looked through (paper III-B).
//!
//! The paper stores no free space and generates it on demand from the recorded poses and a sensor model. Here the model
//! is what the sensor saw: a scan that sees something new leaves a [`Viewpoint`], its pose with a small [`RangeImage`]
//! of how far it saw in each direction. A voxel is free where a viewpoint saw through its center and nothing occupies
//! it.
//!
//! ```text
//! a scan that is kept as a viewpoint                          a scan that is at hand
//!
//! rays --> pixels --> parts of them --> tiles of 8 x 8        rays --> pixels --> hits, joined to a surface
//! (directions) (imaging)                (image)               (directions)        (absence)
//!                                         |                                         |
//! is this place free?      RangeImage::is_free, ViewpointSet  which voxels are gone? ScanSurface::sees_through
//! nothing there any more?  RangeImage::proves_absent          what hides in gaps?    ScanSurface::widest_gap_m
//! do two scans agree?      RangeImage::sight                  do two scans agree?    ScanImage::sight
//! ```
//!
//! Rooms from below: `directions` are pixels of a cube around the sensor, an `image` is what is kept of a scan, and
//! `imaging` makes it of points. `absence` is what a scan proves to be gone, and a `set` has the viewpoints of a
//! map.

mod absence;
mod directions;
mod image;
mod imaging;
mod set;
#[cfg(test)]
mod tests;
mod thresholds;

pub use absence::{RayWindow, ScanSurface, SurfaceSettings};
pub use image::{AbsenceEvidence, IMAGE_BYTES_MAX, Met, RangeImage, RangeImageError, Sight};
pub use imaging::{ScanImage, ScanRays, SensorMismatch, SensorModel, SensorModelError, SensorRays, Sweep};
pub use set::{VIEWPOINT_MEMORY_MAX, Viewpoint, ViewpointCache, ViewpointSet};
pub use set::{newly_seen_by_rays_m3, newly_seen_m3};
pub use thresholds::Thresholds;
