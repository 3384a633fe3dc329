//! The rays of a request in cells of a level.

use super::ray::Ray;
use super::request::{RayError, Rays, Toward};

/// Rays that were asked for, as those of a lattice of cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Request<'a> {
    pub(super) rays: &'a Rays<'a>,
    /// Smallest coordinate of an origin, and one past the largest, meters.
    pub(super) range_m: (f64, f64),
    pub(super) cell_m: f64,
}

impl Request<'_> {
    /// Where ray `number` begins, cells, and with how many that follow it; none where that was said of one before it.
    #[inline(always)]
    pub(super) fn common_origin(&self, number: usize) -> Option<([f64; 3], usize)> {
        let (origins, rays) = (self.rays.origins, self.rays.len());
        let origin = if origins.len() == 1 { origins[0] } else { origins[number] };
        let is_known = number > 0 && (origins.len() == 1 || origins[number - 1].xyz() == origin.xyz());
        if is_known {
            return None;
        }
        let here = || origins[number..].iter().take_while(|other| other.xyz() == origin.xyz()).count();
        let count = if origins.len() == 1 { rays } else { here() };
        Some((origin.xyz().map(|c| f64::from(c) / self.cell_m), count))
    }

    /// Ray `number`, and its length in meters.
    #[inline(always)]
    pub(super) fn ray(&self, number: usize) -> Result<(Ray, f64), RayError> {
        let Rays { origins, toward } = self.rays;
        let at = if origins.len() == 1 { 0 } else { number };
        let (origin, (min_m, end_m)) = (origins[at], self.range_m);
        let origin_m = origin.xyz().map(f64::from);
        if !origin_m.iter().all(|c| (min_m..end_m).contains(c)) {
            return Err(RayError::Origin { at, origin, min_m, end_m });
        }
        let (direction, length_m) = toward.from(number, origin)?;
        if let Toward::Ends(ends) = toward {
            let end = ends[number];
            if !end.xyz().iter().all(|c| (min_m..end_m).contains(&f64::from(*c))) {
                return Err(RayError::EndRange { at: number, end, min_m, end_m });
            }
        }
        Ok((Ray::new(origin_m.map(|c| c / self.cell_m), direction, self.cell_m), length_m))
    }
}
