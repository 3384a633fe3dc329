//! Absence: what a scan that is at hand proves to be gone, by the surface that it shows and the rays that passed.

mod ray_index;
mod scan_surface;

pub use ray_index::RayWindow;
pub use scan_surface::{ScanSurface, SurfaceSettings};
