//! Rays as a caller asks for them: where they begin, and where they lead.

use std::ops::Range;

use crate::geometry::Point;

/// How far the length of a direction may lie from one before it is refused instead of normalized.
pub const DIRECTION_LENGTH_TOLERANCE: f64 = 1e-3;

/// Rays in the map frame.
#[derive(Debug, Clone, Copy)]
pub struct Rays<'a> {
    /// Where each ray begins, meters: one point for each ray, or one for all of them.
    pub origins: &'a [Point],
    /// Where each ray leads.
    pub toward: Toward<'a>,
}

/// Where rays lead.
#[derive(Debug, Clone, Copy)]
pub enum Toward<'a> {
    /// Along unit vectors.
    Directions {
        /// A direction for each ray: of length 1 within [`DIRECTION_LENGTH_TOLERANCE`], and normalized.
        directions: &'a [Point],
        /// Length of each ray, meters, above 0; infinite for rays that end with the map. Where unknown voxels are met,
        /// a ray may not leave the map's lattice with nothing met.
        range_m: f64,
    },
    /// To points: one for each ray, meters, in the range of the map's lattice, which is where the ray ends.
    Ends(&'a [Point]),
}

/// Why rays cannot be cast.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RayError {
    /// Neither one origin nor as many as rays.
    #[error("origins must be one, or one for each of the {rays} rays, got {origins}")]
    Origins {
        /// Number of origins.
        origins: usize,
        /// Number of rays.
        rays: usize,
    },
    /// A range that is no number above 0.
    #[error("range_m must be above 0, got {0}")]
    Range(f64),
    /// An origin that is not finite or in no voxel of the map's lattice.
    #[error("origins[{at}] must lie in {min_m}..{end_m} m in each axis, got {origin:?}")]
    Origin {
        /// Which origin.
        at: usize,
        /// The origin.
        origin: Point,
        /// Smallest coordinate, meters.
        min_m: f64,
        /// One past the largest coordinate, meters.
        end_m: f64,
    },
    /// A direction that is not finite, or no unit vector.
    #[error(
        "directions[{at}] must have length 1 within {DIRECTION_LENGTH_TOLERANCE}, got {direction:?} of length {length}"
    )]
    Direction {
        /// Which ray.
        at: usize,
        /// The direction.
        direction: Point,
        /// Its length.
        length: f64,
    },
    /// An end that is in no voxel of the map's lattice.
    #[error("ends[{at}] must lie in {min_m}..{end_m} m in each axis, got {end:?}")]
    EndRange {
        /// Which ray.
        at: usize,
        /// The end.
        end: Point,
        /// Smallest coordinate, meters.
        min_m: f64,
        /// One past the largest coordinate, meters.
        end_m: f64,
    },
    /// A ray that leaves the map's lattice with nothing met, where unknown voxels are met.
    #[error(
        "directions[{at}] leads out of {min_m}..{end_m} m with nothing met, {left_m} m from its origin: what is beyond is unknown, take a shorter range_m"
    )]
    Leaves {
        /// Which ray.
        at: usize,
        /// How far from its origin it leaves the lattice, meters.
        left_m: f64,
        /// Smallest coordinate, meters.
        min_m: f64,
        /// One past the largest coordinate, meters.
        end_m: f64,
    },
    /// An end that is not finite, or where the ray begins.
    #[error("ends[{at}] must be finite and apart from its origin {origin:?}, got {end:?}")]
    End {
        /// Which ray.
        at: usize,
        /// The end.
        end: Point,
        /// The origin of the ray.
        origin: Point,
    },
}

impl<'a> Rays<'a> {
    /// Number of rays.
    pub fn len(&self) -> usize {
        match self.toward {
            Toward::Directions { directions, .. } => directions.len(),
            Toward::Ends(ends) => ends.len(),
        }
    }

    /// True without a ray.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Some of the rays, by their numbers.
    #[must_use]
    pub fn part(self, of: Range<usize>) -> Self {
        let toward = match self.toward {
            Toward::Directions { directions, range_m } => {
                Toward::Directions { directions: &directions[of.clone()], range_m }
            }
            Toward::Ends(ends) => Toward::Ends(&ends[of.clone()]),
        };
        Self { origins: if self.origins.len() == 1 { self.origins } else { &self.origins[of] }, toward }
    }

    /// The error of a part of the rays as one of all of them, of which so many come before the part.
    pub fn error_behind(&self, before: usize, mut error: RayError) -> RayError {
        match &mut error {
            RayError::Origin { .. } if self.origins.len() == 1 => {}
            RayError::Origin { at, .. }
            | RayError::Direction { at, .. }
            | RayError::EndRange { at, .. }
            | RayError::Leaves { at, .. }
            | RayError::End { at, .. } => *at += before,
            RayError::Origins { .. } | RayError::Range(_) => {}
        }
        error
    }

    /// Checks what concerns all rays.
    ///
    /// # Errors
    /// Where the origins are neither one nor as many as rays, or the range is no number above 0.
    pub fn checked(&self) -> Result<(), RayError> {
        let (origins, rays) = (self.origins.len(), self.len());
        if origins != 1 && origins != rays {
            return Err(RayError::Origins { origins, rays });
        }
        match self.toward {
            Toward::Directions { range_m, .. } if range_m.is_nan() || range_m <= 0.0 => {
                Err(RayError::Range(range_m))
            }
            _ => Ok(()),
        }
    }
}

impl Toward<'_> {
    /// The unit vector of ray `at`, and its length in meters.
    #[inline(always)]
    pub(super) fn from(&self, at: usize, origin: Point) -> Result<([f64; 3], f64), RayError> {
        match *self {
            Self::Directions { directions, range_m } => {
                let direction = directions[at].xyz().map(f64::from);
                let length = length(direction);
                let is_unit = (length - 1.0).abs() <= DIRECTION_LENGTH_TOLERANCE;
                if !is_unit {
                    return Err(RayError::Direction { at, direction: directions[at], length });
                }
                Ok((unit_vector(direction, length), range_m))
            }
            Self::Ends(ends) => {
                let (from, to) = (origin.xyz(), ends[at].xyz());
                let way = std::array::from_fn(|axis| f64::from(to[axis]) - f64::from(from[axis]));
                let length = length(way);
                if !(length > 0.0 && length.is_finite()) {
                    return Err(RayError::End { at, end: ends[at], origin });
                }
                Ok((unit_vector(way, length), length))
            }
        }
    }
}

/// A direction of this length as one of length 1.
#[inline(always)]
fn unit_vector(direction: [f64; 3], length: f64) -> [f64; 3] {
    let share = 1.0 / length;
    direction.map(|c| c * share)
}

#[inline(always)]
fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
