//! What bodies are made of: rigid links of spheres and points.

use crate::geometry::Point;
use crate::planning::error::{PlanningError, SpherePlace};

/// Largest radius and padding, meters.
pub(in crate::planning) const RADIUS_MAX_M: f32 = 1000.0;

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
/// A sphere meets a voxel where the closed ball and the closed cube share a point. A point without padding meets the
/// voxel that it falls in; with padding it is a sphere of that radius.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Link {
    /// Its spheres.
    pub spheres: Vec<Sphere>,
    /// Its points, meters.
    pub points: Vec<Point>,
    /// What is added to the radii of spheres and points, meters.
    pub padding_m: f32,
}

/// The center of a part and its radius with padding, meters.
pub(super) type PaddedPart = ([f64; 3], f64);

impl Sphere {
    /// The center and the radius with padding, meters.
    pub(in crate::planning) fn padded(&self, padding_m: f32) -> PaddedPart {
        (self.center_m.map(f64::from), f64::from(self.radius_m) + f64::from(padding_m))
    }

    /// True of a finite center and a radius from 0 to [`RADIUS_MAX_M`].
    pub(in crate::planning) fn is_valid(&self) -> bool {
        self.center_m.iter().all(|c| c.is_finite()) && (0.0..=RADIUS_MAX_M).contains(&self.radius_m)
    }

    /// Why it is none.
    pub(in crate::planning) fn refused(&self, place: SpherePlace) -> PlanningError {
        let Self { center_m, radius_m } = *self;
        PlanningError::Sphere { place, center_m, radius_m, radius_max_m: RADIUS_MAX_M }
    }
}

impl Link {
    /// True of a link with a sphere or a point.
    pub(in crate::planning) fn has_parts(&self) -> bool {
        !(self.spheres.is_empty() && self.points.is_empty())
    }

    /// Centers and radii of all parts with padding, meters: spheres in their order, points after them.
    pub(super) fn padded(&self) -> impl Iterator<Item = PaddedPart> {
        let spheres = self.spheres.iter().map(|sphere| sphere.padded(self.padding_m));
        let points = self.points.iter().map(|point| (point.xyz().map(f64::from), f64::from(self.padding_m)));
        spheres.chain(points)
    }

    /// The same as balls and as points without padding: those meet what they fall in.
    pub(in crate::planning) fn balls_and_points(&self) -> (Vec<PaddedPart>, Vec<[f64; 3]>) {
        let mut balls: Vec<_> = self.padded().collect();
        let is_padded = self.padding_m > 0.0;
        let points = if is_padded { Vec::new() } else { balls.split_off(self.spheres.len()) };
        (balls, points.into_iter().map(|(point, _)| point).collect())
    }

    pub(super) fn check(&self, link: usize) -> Result<(), PlanningError> {
        if !(0.0..=RADIUS_MAX_M).contains(&self.padding_m) {
            let padding_m = self.padding_m;
            return Err(PlanningError::Padding { link, padding_m, padding_max_m: RADIUS_MAX_M });
        }
        if let Some(sphere) = self.spheres.iter().position(|sphere| !sphere.is_valid()) {
            return Err(self.spheres[sphere].refused(SpherePlace::InLink { link, sphere }));
        }
        if let Some(point) = self.points.iter().position(|point| !point.is_finite()) {
            return Err(PlanningError::Point { link, point, xyz_m: self.points[point].xyz() });
        }
        Ok(())
    }
}
