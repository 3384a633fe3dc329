//! Rays: what each meets first, and how far away.

mod ray;
mod space;
#[cfg(test)]
mod tests;

use crate::geometry::Point;
use crate::map::MapView;
use crate::util::StopSignal;
use crate::voxel::{Lattice, VoxelKey};
use ray::Ray;
use space::Space;

/// How far the length of a direction may lie from one before it is refused instead of normalized.
pub const DIRECTION_LENGTH_TOLERANCE: f64 = 1e-3;

/// Rays that are cast between two looks at the stop signal: about a millisecond.
const RAYS_PER_LOOK: usize = 4096;

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
        /// Length of each ray, meters, above 0; infinite for rays that end with the map.
        range_m: f64,
    },
    /// To points: one for each ray, meters, which is where the ray ends.
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

/// What rays met.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RayHits {
    /// Whether ray i met a voxel: bit i % 64 of `hit[i / 64]`.
    pub hit: Vec<u64>,
    /// From the origin to where the ray enters the cube of the voxel, meters; 0 where it begins in it, infinite where it met
    /// none.
    pub distances_m: Vec<f32>,
    /// The voxel, of the level that was asked; of a ray that met none, the voxel of index 0 0 0.
    pub voxels: Vec<VoxelKey>,
}

impl RayHits {
    fn of_capacity(rays: usize) -> Self {
        Self {
            hit: vec![0; rays.div_ceil(64)],
            distances_m: Vec::with_capacity(rays),
            voxels: Vec::with_capacity(rays),
        }
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.distances_m.len()
    }

    /// True without a ray.
    pub fn is_empty(&self) -> bool {
        self.distances_m.is_empty()
    }

    /// Number of rays that met a voxel.
    pub fn hits(&self) -> usize {
        self.hit.iter().map(|word| word.count_ones() as usize).sum()
    }

    #[inline(always)]
    fn push(&mut self, hit: Option<(f64, VoxelKey)>) {
        let at = self.len();
        self.hit[at / 64] |= u64::from(hit.is_some()) << (at % 64);
        let (distance_m, voxel) = hit.unwrap_or((f64::INFINITY, VoxelKey::default()));
        self.distances_m.push(distance_m as f32);
        self.voxels.push(voxel);
    }
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

    /// Checks what concerns all rays.
    fn checked(&self) -> Result<(), RayError> {
        let (origins, rays) = (self.origins.len(), self.len());
        if origins != 1 && origins != rays {
            return Err(RayError::Origins { origins, rays });
        }
        match self.toward {
            Toward::Directions { range_m, .. } if !(range_m > 0.0) => Err(RayError::Range(range_m)),
            _ => Ok(()),
        }
    }

    /// Ray `at` in cells of `cell_m`, and its length in meters.
    #[inline(always)]
    fn ray(&self, at: usize, lattice: &Lattice, cell_m: f64) -> Result<(Ray, f64), RayError> {
        let origin_at = if self.origins.len() == 1 { 0 } else { at };
        let origin = self.origins[origin_at];
        let origin_m = origin.xyz().map(f64::from);
        let (min_m, end_m) = lattice.range_m();
        if !origin_m.iter().all(|c| (min_m..end_m).contains(c)) {
            return Err(RayError::Origin { at: origin_at, origin, min_m, end_m });
        }
        let (direction, range_m) = self.toward.from(at, origin)?;
        Ok((Ray::new(origin_m.map(|c| c / cell_m), direction, cell_m), range_m))
    }
}

impl Toward<'_> {
    /// The unit vector of ray `at`, and its length in meters.
    #[inline(always)]
    fn from(&self, at: usize, origin: Point) -> Result<([f64; 3], f64), RayError> {
        match *self {
            Self::Directions { directions, range_m } => {
                let direction = directions[at].xyz().map(f64::from);
                let length = length(direction);
                if !((length - 1.0).abs() <= DIRECTION_LENGTH_TOLERANCE) {
                    return Err(RayError::Direction { at, direction: directions[at], length });
                }
                Ok((direction.map(|c| c / length), range_m))
            }
            Self::Ends(ends) => {
                let (from, to) = (origin.xyz(), ends[at].xyz());
                let way = std::array::from_fn(|axis| f64::from(to[axis]) - f64::from(from[axis]));
                let length = length(way);
                if !(length > 0.0 && length.is_finite()) {
                    return Err(RayError::End { at, end: ends[at], origin });
                }
                Ok((way.map(|c| c / length), length))
            }
        }
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// What each ray meets first of the occupied voxels of `level`.
///
/// Voxel i of an axis is the cube from i r_n to (i + 1) r_n, in exact meters. A ray meets the voxels in which it runs for
/// some way, and not those that it only touches: through an edge or a corner it goes from one voxel to the one across. A
/// border that it crosses belongs to the voxel that it moves into, and a border along which it runs to the upper voxel, as
/// points on it do. A voxel that it would enter just where it ends is not met.
///
/// The view must cover the whole map. The walk leaps over empty space by the blocks and clusters of blocks that are not
/// there, and comes out where single steps would (both computed in f64, and compared bit for bit in tests). Takes 12 bytes
/// a ray. Once stopped, the answer has fewer rays.
///
/// # Errors
/// When a ray is none; the error names which, and why.
pub fn cast_rays(
    view: &MapView<'_>,
    rays: &Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
) -> Result<RayHits, RayError> {
    rays.checked()?;
    let mut hits = RayHits::of_capacity(rays.len());
    let tier = view.tier_view(level);
    let (lattice, cell_m) = (view.lattice(), tier.cell_m());
    let mut space = view.cell_bounds(level).map(|bounds| Space::new(tier, bounds));
    for at in stop.paced(0..rays.len(), RAYS_PER_LOOK) {
        let (ray, range_m) = rays.ray(at, lattice, cell_m)?;
        hits.push(space.as_mut().and_then(|space| space.first_hit(&ray, range_m)));
    }
    Ok(hits)
}
