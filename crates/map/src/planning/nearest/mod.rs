//! The nearest voxel of points: how far away it is, and which way leads away from it.

mod block;
mod keep_outs;
mod search;
mod seeker;
#[cfg(test)]
mod tests;

use super::keep_outs::Shapes;
use crate::geometry::Point;
use crate::map::{KeepOutName, MapView};
use crate::util::{Keyword, StopSignal};
use crate::voxel::{Cluster, VoxelKey};
use search::Search;

/// Largest radius of a search, voxels of the level that is asked.
pub const RADIUS_VOXELS_MAX: f64 = 64.0;

/// Points that are searched between two looks at the stop signal: at worst some milliseconds.
const POINTS_PER_LOOK: usize = 64;

/// What of a voxel a distance is measured to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeasuredTo {
    /// Its cube: 0 for a point in it.
    #[default]
    Cubes,
    /// Its center.
    Centers,
}

impl Keyword for MeasuredTo {
    const ALL: &'static [Self] = &[Self::Cubes, Self::Centers];

    fn as_str(self) -> &'static str {
        match self {
            Self::Cubes => "cubes",
            Self::Centers => "centers",
        }
    }
}

/// Points of the map frame, and how far from them to look.
#[derive(Debug, Clone, Copy)]
pub struct NearestRequest<'a> {
    /// The points, meters. One that is not finite has no voxel near.
    pub points: &'a [Point],
    /// Level of the voxels.
    pub level: u32,
    /// How far to look, meters: above 0, at most [`RADIUS_VOXELS_MAX`] voxels.
    pub radius_m: f64,
    /// What distances are measured to.
    pub to: MeasuredTo,
}

/// Why the nearest voxels cannot be found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NearestError {
    /// A radius that is no number above 0, or too large.
    #[error(
        "radius_m must lie above 0 and at most {max_m} m, {RADIUS_VOXELS_MAX} voxels of level {level}, got {radius_m}"
    )]
    Radius {
        /// The radius, meters.
        radius_m: f64,
        /// Largest radius, meters.
        max_m: f64,
        /// The level.
        level: u32,
    },
}

/// The nearest voxel of each point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NearestVoxels {
    /// Whether there is a voxel or a keep-out within the radius of point i: bit i % 64 of `found[i / 64]`.
    pub found: Vec<u64>,
    /// Distance to it, meters; infinite where there is none.
    pub distances_m: Vec<f32>,
    /// The voxel; where there is none or a keep-out is nearer, the voxel of index 0 0 0.
    pub voxels: Vec<VoxelKey>,
    /// The unit vector from the nearest place of the voxel to the point, x y z: the way on which the distance grows
    /// fastest. Zero where the distance is, and where there is no voxel.
    pub away: Vec<[f32; 3]>,
    /// The keep-out of each point to which one is nearer than all voxels; empty where there is no such point.
    pub keep_outs: Vec<Option<KeepOutName>>,
}

/// The nearest voxel of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Nearest {
    distance_m: f64,
    voxel: VoxelKey,
    away: [f64; 3],
}

impl NearestVoxels {
    fn of_capacity(points: usize) -> Self {
        Self {
            found: vec![0; points.div_ceil(64)],
            distances_m: Vec::with_capacity(points),
            voxels: Vec::with_capacity(points),
            away: Vec::with_capacity(points),
            keep_outs: Vec::new(),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.distances_m.len()
    }

    /// True without a point.
    pub fn is_empty(&self) -> bool {
        self.distances_m.is_empty()
    }

    /// Number of points with a voxel within the radius.
    pub fn count(&self) -> usize {
        self.found.iter().map(|word| word.count_ones() as usize).sum()
    }

    fn set(&mut self, at: usize, Nearest { distance_m, voxel, away }: Nearest) {
        self.found[at / 64] |= 1 << (at % 64);
        (self.distances_m[at], self.voxels[at]) = (distance_m as f32, voxel);
        self.away[at] = away.map(|c| c as f32);
    }

    fn push(&mut self, nearest: Option<Nearest>) {
        let at = self.len();
        self.found[at / 64] |= u64::from(nearest.is_some()) << (at % 64);
        let none = Nearest { distance_m: f64::INFINITY, voxel: VoxelKey::default(), away: [0.0; 3] };
        let Nearest { distance_m, voxel, away } = nearest.unwrap_or(none);
        self.distances_m.push(distance_m as f32);
        self.voxels.push(voxel);
        self.away.push(away.map(|c| c as f32));
    }
}

/// The nearest occupied voxel of each point, within a radius.
///
/// Exact: distances are those of f64, in voxels, from the point to the closed cube from i r_n to (i + 1) r_n, or to its
/// center. A voxel just at the radius is within it. Of voxels equally far, the one of the smallest packed key is taken.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), one that is nearer than all voxels takes their place; distances
/// to it are those to its border, whatever distances to voxels are measured to.
///
/// The view must cover the whole map. Takes 24 bytes a point. Once stopped, the answer has fewer points.
///
/// # Errors
/// When the radius is out of range.
pub fn find_nearest(
    view: &MapView<'_>,
    request: &NearestRequest<'_>,
    stop: StopSignal<'_>,
) -> Result<NearestVoxels, NearestError> {
    let NearestRequest { points, level, radius_m, to } = *request;
    let max_m = RADIUS_VOXELS_MAX * view.lattice().resolution_m(level);
    if !(radius_m > 0.0 && radius_m <= max_m) {
        return Err(NearestError::Radius { radius_m, max_m, level });
    }
    let nothing = Cluster::default();
    let mut search = Search::new(view.tier_view(level), &nothing, radius_m, to);
    let mut nearest = NearestVoxels::of_capacity(points.len());
    for &point in stop.paced(points, POINTS_PER_LOOK) {
        nearest.push(search.nearest(point));
    }
    if let Some(shapes) = Shapes::of(view) {
        keep_outs::mend(&shapes, points, radius_m, &mut nearest, stop);
    }
    Ok(nearest)
}
