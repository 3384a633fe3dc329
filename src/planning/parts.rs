//! What bodies are made of: rigid links of spheres and points.

use super::PlanningError;
use crate::geometry::Point;

/// Largest radius and padding, meters.
pub(super) const RADIUS_MAX_M: f32 = 1000.0;

/// A sphere in a frame of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// The center, meters.
    pub center_m: [f32; 3],
    /// The radius, meters.
    pub radius_m: f32,
}

/// A rigid part of a body, in a frame of its own.
///
/// A sphere meets a voxel where the closed ball and the closed cube share a point. A point without padding meets the voxel
/// that it falls in; with padding it is a sphere of that radius.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Link {
    /// Its spheres.
    pub spheres: Vec<Sphere>,
    /// Its points, meters.
    pub points: Vec<Point>,
    /// What is added to the radii of spheres and points, meters.
    pub padding_m: f32,
}

impl Sphere {
    /// True of a finite center and a radius from 0 to [`RADIUS_MAX_M`].
    pub(super) fn is_valid(&self) -> bool {
        self.center_m.iter().all(|c| c.is_finite()) && (0.0..=RADIUS_MAX_M).contains(&self.radius_m)
    }

    /// Why it is none.
    pub(super) fn refused(&self, link: usize, sphere: usize) -> PlanningError {
        let Self { center_m, radius_m } = *self;
        PlanningError::Sphere { link, sphere, center_m, radius_m, radius_max_m: RADIUS_MAX_M }
    }
}

impl Link {
    pub(super) fn check(&self, link: usize) -> Result<(), PlanningError> {
        if !(0.0..=RADIUS_MAX_M).contains(&self.padding_m) {
            let padding_m = self.padding_m;
            return Err(PlanningError::Padding { link, padding_m, padding_max_m: RADIUS_MAX_M });
        }
        if let Some(sphere) = self.spheres.iter().position(|sphere| !sphere.is_valid()) {
            return Err(self.spheres[sphere].refused(link, sphere));
        }
        if let Some(point) = self.points.iter().position(|point| !point.is_finite()) {
            return Err(PlanningError::Point { link, point, xyz_m: self.points[point].xyz() });
        }
        Ok(())
    }
}
