//! Rays among keep-outs: each ends where it enters the first one, where that is before it meets a voxel.

use super::hits::RayHits;
use super::request::{RayError, Rays};
use crate::map::ShapeRay;
use crate::planning::keep_outs::Shapes;
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Rays between two checks of the stop signal.
const RAYS_PER_STOP_CHECK: usize = 64;

/// Ends rays at shapes. A border that a ray enters just where it ends is not met.
pub(super) fn end_at(
    shapes: &Shapes<'_>,
    rays: &Rays<'_>,
    hits: &mut RayHits,
    stop: StopSignal<'_>,
) -> Result<(), RayError> {
    for number in stop.paced(0..rays.len(), RAYS_PER_STOP_CHECK) {
        let (ray, range_m) = rays.ray(number)?;
        // A voxel's distance is told as a float: what is not nearer than that is behind the voxel.
        let (mut end_m, mut first) = (range_m.min(f64::from(hits.distances_m[number])), None);
        for of in shapes.iter() {
            if let Some(at_m) = of.keep_out.shape.entered_m(&ray).filter(|at_m| *at_m < end_m) {
                (end_m, first) = (at_m, Some(of.keep_out));
            }
        }
        if let Some(keep_out) = first {
            hits.set(number, end_m, VoxelKey::default());
            hits.keep_outs.resize(hits.distances_m.len(), None);
            hits.keep_outs[number] = Some(keep_out.name.clone());
        }
    }
    Ok(())
}

impl Rays<'_> {
    /// Where ray `number` begins, and where it ends when it goes `most_m` at most, meters.
    ///
    /// # Errors
    /// For a ray that is none.
    pub fn ends_m(&self, number: usize, most_m: f64) -> Result<([f64; 3], [f64; 3]), RayError> {
        let (ShapeRay { origin_m, direction }, length_m) = self.ray(number)?;
        let along = |axis: usize| match direction[axis] {
            // No length leads anywhere along it.
            0.0 => 0.0,
            share => share * length_m.min(most_m),
        };
        Ok((origin_m, std::array::from_fn(|axis| origin_m[axis] + along(axis))))
    }

    /// Ray `number` in meters, and its length.
    fn ray(&self, number: usize) -> Result<(ShapeRay, f64), RayError> {
        let origin = self.origins[if self.origins.len() == 1 { 0 } else { number }];
        let (direction, length_m) = self.toward.from(number, origin)?;
        Ok((ShapeRay { origin_m: origin.xyz().map(f64::from), direction }, length_m))
    }
}
