//! Rays: what each meets first, and how far away.

mod clear_box;
mod in_sight;
mod keep_outs;
mod ray;
mod space;
#[cfg(test)]
mod tests;
mod turns;

use super::free_space::FreeSpace;
use super::keep_outs::Shapes;
use crate::geometry::Point;
use crate::map::{KeepOutName, MapView, TierView};
use crate::util::StopSignal;
use crate::voxel::{Cluster, VoxelKey};
pub(super) use in_sight::clear_m;
use ray::Ray;
use space::Space;
use turns::Turns;

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
    /// Whether ray i met a voxel or a keep-out: bit i % 64 of `hit[i / 64]`.
    pub hit: Vec<u64>,
    /// From the origin to where the ray enters the cube of the voxel or the keep-out, meters; 0 where it begins in it, infinite
    /// where it met none.
    pub distances_m: Vec<f32>,
    /// The voxel, of the level that was asked; of a ray that met none, the voxel of index 0 0 0, and of one
    /// that met a keep-out too.
    pub voxels: Vec<VoxelKey>,
    /// The keep-out of each ray that met one instead of a voxel; empty where no ray did.
    pub keep_outs: Vec<Option<KeepOutName>>,
}

impl RayHits {
    /// No hit of any of so many rays.
    fn none_of(rays: usize) -> Self {
        Self {
            hit: vec![0; rays.div_ceil(64)],
            distances_m: vec![f32::INFINITY; rays],
            voxels: vec![VoxelKey::default(); rays],
            keep_outs: Vec::new(),
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
    fn set(&mut self, ray: usize, distance_m: f64, voxel: VoxelKey) {
        self.hit[ray / 64] |= 1 << (ray % 64);
        self.distances_m[ray] = distance_m as f32;
        self.voxels[ray] = voxel;
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
    fn from(&self, at: usize, origin: Point) -> Result<([f64; 3], f64), RayError> {
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

/// Rays that were asked for, as those of a lattice of cells.
#[derive(Debug, Clone, Copy)]
struct Request<'a> {
    rays: &'a Rays<'a>,
    /// Smallest coordinate of an origin, and one past the largest, meters.
    range_m: (f64, f64),
    cell_m: f64,
}

impl Request<'_> {
    /// Where ray `number` begins, cells, and with how many that follow it; none where that was said of one before it.
    #[inline(always)]
    fn common_origin(&self, number: usize) -> Option<([f64; 3], usize)> {
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
    fn ray(&self, number: usize) -> Result<(Ray, f64), RayError> {
        let Rays { origins, toward } = self.rays;
        let at = if origins.len() == 1 { 0 } else { number };
        let (origin, (min_m, end_m)) = (origins[at], self.range_m);
        let origin_m = origin.xyz().map(f64::from);
        if !origin_m.iter().all(|c| (min_m..end_m).contains(c)) {
            return Err(RayError::Origin { at, origin, min_m, end_m });
        }
        let (direction, length_m) = toward.from(number, origin)?;
        Ok((Ray::new(origin_m.map(|c| c / self.cell_m), direction, self.cell_m), length_m))
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

/// What each ray meets first of the occupied voxels of `level`.
///
/// Voxel i of an axis is the cube from i r_n to (i + 1) r_n, in exact meters. A ray meets the voxels in which it runs for
/// some way, and not those that it only touches: through an edge or a corner it goes from one voxel to the one across. A
/// border that it crosses belongs to the voxel that it moves into, and a border along which it runs to the upper voxel, as
/// points on it do. A voxel that it would enter just where it ends is not met.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), a ray meets the first one that it is inside, its border
/// included, before it meets a voxel; not one that it would enter just where it ends.
///
/// The view must cover the whole map. The walk leaps over empty space by the blocks and clusters of blocks that are not
/// there, and comes out where single steps would (both computed in f64, and compared bit for bit in tests). Takes 12 bytes
/// a ray. Once stopped, rays are left that met nothing yet.
///
/// # Errors
/// When a ray is none; the error names which, and why.
pub fn cast_rays(
    view: &MapView<'_>,
    rays: &Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
) -> Result<RayHits, RayError> {
    let nothing = Cluster::default();
    cast(view, rays, level, stop, |tier, request, hits| match view.cell_bounds(level) {
        Some(bounds) => Turns::new(Space::new(tier, bounds, &nothing), request).walk(hits, stop),
        None => (0..rays.len()).try_for_each(|number| request.ray(number).map(|_| ())),
    })
}

/// What each ray meets first of the voxels of `level` that are not free: those that are occupied, and those that no scan saw
/// through, as far as the view has viewpoints ([`MapView::with_viewpoints`]).
///
/// As [`cast_rays`] otherwise. Rays go voxel by voxel, and end with the map's lattice.
///
/// # Errors
/// As for [`cast_rays`].
pub fn cast_rays_in_sight(
    view: &MapView<'_>,
    rays: &Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
) -> Result<RayHits, RayError> {
    let nothing = Cluster::default();
    cast(view, rays, level, stop, |tier, request, hits| {
        let space = Space::new(tier, view.lattice_bounds(level), &nothing);
        in_sight::walk(space, &request, (level, FreeSpace::of(view)), hits, stop)
    })
}

/// What rays meet first that `walk` through the voxels of `level`, and end where they enter a keep-out of the view.
fn cast<'a>(
    view: &'a MapView<'_>,
    rays: &'a Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
    walk: impl FnOnce(TierView<'a>, Request<'a>, &mut RayHits) -> Result<(), RayError>,
) -> Result<RayHits, RayError> {
    rays.checked()?;
    let mut hits = RayHits::none_of(rays.len());
    let tier = view.tier_view(level);
    let request = Request { rays, range_m: view.lattice().range_m(), cell_m: tier.cell_m() };
    walk(tier, request, &mut hits)?;
    if let Some(shapes) = Shapes::of(view) {
        keep_outs::end_at(&shapes, rays, &mut hits, stop)?;
    }
    Ok(hits)
}
