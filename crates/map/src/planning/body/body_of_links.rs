//! Bodies: what is asked about.

use std::borrow::Cow;

use super::in_cells::BodyInCells;
use super::parts::Link;
use super::prepared::Prepared;
use crate::planning::error::PlanningError;

/// What is asked about: links, each of which has a pose of its own in a configuration.
///
/// What it is in voxels of a level is made once, and kept: ask about one body again rather than about another like it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    links: Vec<Link>,
    prepared: Prepared,
}

impl Body {
    /// A body of `links`.
    ///
    /// # Errors
    /// Without a link, without a sphere or point in any of them, or when a number is not finite or out of range; the
    /// error names it.
    pub fn new(links: Vec<Link>) -> Result<Self, PlanningError> {
        if links.is_empty() {
            return Err(PlanningError::NoLinks);
        }
        if !links.iter().any(Link::has_parts) {
            return Err(PlanningError::NoParts { links: links.len() });
        }
        links.iter().enumerate().try_for_each(|(number, link)| link.check(number))?;
        Ok(Self { links, prepared: Prepared::default() })
    }

    /// Number of links, and of spheres and points of all links.
    pub fn parts(&self) -> usize {
        self.links.iter().map(|link| 1 + link.spheres.len() + link.points.len()).sum()
    }

    /// The links.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The body in cells, so many a meter.
    pub(in crate::planning) fn in_cells(
        &self,
        cells_per_m: f64,
    ) -> Result<Cow<'_, BodyInCells>, PlanningError> {
        self.prepared.of(&self.links, cells_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::planning::Sphere;

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
        // It would fit everywhere.
        assert_eq!(Body::new(vec![Link::default(); 2]), Err(PlanningError::NoParts { links: 2 }));
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
