//! The answer: frontiers, each with a place from which it can be seen.

use crate::geometry::Pose;

/// A frontier: free voxels beside unknown ones that hang together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frontier {
    /// Number of voxels.
    pub voxels: u64,
    /// The mean of their centers, meters.
    pub center_m: [f64; 3],
    /// The box that holds them, borders of voxels: smallest coordinates, meters.
    pub min_m: [f64; 3],
    /// Largest coordinates.
    pub max_m: [f64; 3],
    /// From where it can be seen, where such a place was found.
    pub view: Option<FrontierView>,
}

/// A place from which a frontier can be seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierView {
    /// The place, in a free voxel, and the way it looks: x forward, y to the left and level.
    pub map_from_view: Pose,
    /// The center of the voxel that it looks at, meters: the one of the frontier that is nearest to its mean.
    pub target_m: [f64; 3],
    /// Direction of the look from x to y, radians.
    pub yaw_rad: f64,
    /// How far up it looks, radians; negative for down.
    pub elevation_rad: f64,
}

/// The frontiers of a box, the largest first; of those as large, the one whose first voxel has the smaller z, then y,
/// then x.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frontiers {
    /// Those that are told.
    pub frontiers: Vec<Frontier>,
    /// How many there are of the least size or larger, told or not.
    pub frontiers_total: u64,
    /// How many voxels of the box are frontiers, those of small ones too.
    pub voxels_total: u64,
}
