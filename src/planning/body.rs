//! Bodies: rigid links of spheres and points.

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

/// What is asked about: links, each of which has a pose of its own in a configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    links: Vec<Link>,
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

impl Body {
    /// A body of `links`.
    ///
    /// # Errors
    /// Without a link, or when a number is not finite or out of range; the error names it.
    pub fn new(links: Vec<Link>) -> Result<Self, PlanningError> {
        if links.is_empty() {
            return Err(PlanningError::NoLinks);
        }
        links.iter().enumerate().try_for_each(|(number, link)| link.check(number))?;
        Ok(Self { links })
    }

    /// The links.
    pub fn links(&self) -> &[Link] {
        &self.links
    }
}

impl Link {
    fn check(&self, link: usize) -> Result<(), PlanningError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn body(sphere: [f32; 4], point: f32, padding_m: f32) -> Result<Body, PlanningError> {
        let [x, y, z, radius_m] = sphere;
        let spheres = vec![Sphere { center_m: [x, y, z], radius_m }];
        Body::new(vec![
            Link::default(),
            Link { spheres, points: vec![Point::new(0.0, point, 0.0)], padding_m },
        ])
    }

    #[test]
    fn a_body_is_made_of_numbers_in_range() {
        assert!(body([0.0, -1e30, 2.0, 0.0], 1.0, 0.0).is_ok());
        assert!(body([0.0, 1.0, 2.0, 1000.0], 1.0, 1000.0).is_ok());
        assert_eq!(Body::new(Vec::new()), Err(PlanningError::NoLinks));
    }

    #[test]
    fn an_error_names_the_number() {
        for (body, expected) in [
            (body([0.0, f32::NAN, 0.0, 0.1], 0.0, 0.0), "links[1].spheres[0]"),
            (body([0.0, 0.0, 0.0, -0.1], 0.0, 0.0), "0..=1000 m, got [0.0, 0.0, 0.0] and -0.1"),
            (body([0.0, 0.0, 0.0, 1000.1], 0.0, 0.0), "and 1000.1"),
            (body([0.0, 0.0, 0.0, f32::NAN], 0.0, 0.0), "and NaN"),
            (body([0.0; 4], f32::INFINITY, 0.0), "links[1].points[0] must be finite, got [0.0, inf, 0.0]"),
            (body([0.0; 4], 0.0, -1.0), "links[1].padding_m must lie in 0..=1000 m, got -1"),
        ] {
            let error = body.unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
