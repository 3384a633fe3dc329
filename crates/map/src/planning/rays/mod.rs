//! Rays: what each meets first, and how far away.

mod cast;
mod clear_box;
mod hits;
mod in_sight;
mod interleaved;
mod keep_outs;
mod ray;
mod rays_in_cells;
mod request;
mod space;
#[cfg(test)]
mod tests;

pub use cast::{cast_rays, cast_rays_in_sight};
pub use hits::RayHits;
pub(super) use in_sight::clear_m;
pub use request::{DIRECTION_LENGTH_TOLERANCE, RayError, Rays, Toward};
