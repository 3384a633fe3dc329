//! The request: points, how far to look, and what distances are measured to.

use crate::geometry::Point;
use crate::planning::unknown::OutOfRange;
use crate::util::Keyword;

/// Largest radius of a search, voxels of the level that is asked.
pub const RADIUS_VOXELS_MAX: f64 = 64.0;

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
    /// The points, meters, in the range of the map's lattice.
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
    /// A point in no voxel of the map's lattice.
    #[error(transparent)]
    Point(#[from] OutOfRange),
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

impl NearestError {
    /// The error of some of the points as one of all of them, of which so many come before.
    #[must_use]
    pub fn behind(self, before: usize) -> Self {
        match self {
            Self::Point(error) => Self::Point(OutOfRange { at: error.at + before, ..error }),
            Self::Radius { .. } => self,
        }
    }
}
