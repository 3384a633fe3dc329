//! The request: the box in which frontiers are looked for, and which of them are listed.

/// How far from a frontier it is looked at where nobody says, in voxels of the level.
pub const STANDOFF_VOXELS: f64 = 20.0;
/// Largest distance from which a frontier is looked at, in voxels of the level.
pub const STANDOFF_VOXELS_MAX: f64 = 256.0;

/// Least number of voxels of a frontier where nobody says.
pub const FRONTIER_SIZE_MIN_DEFAULT: u64 = 8;

/// Where to look for frontiers, and which.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierRequest {
    /// Level of the voxels.
    pub level: u32,
    /// Smallest coordinates of the box that is looked into, meters: voxels belong to it whose centers lie in it.
    pub min_m: [f64; 3],
    /// Largest coordinates.
    pub max_m: [f64; 3],
    /// Least number of voxels of a frontier that is told.
    pub size_min: u64,
    /// Most frontiers that are told, the largest.
    pub frontiers_max: usize,
    /// How far from the middle of a frontier it is looked at, meters; [`STANDOFF_VOXELS`] voxels without.
    pub standoff_m: Option<f64>,
    /// Most voxels of the box.
    pub cells_max: usize,
}

/// Why frontiers cannot be looked for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FrontierError {
    /// Corners that are not finite or in the wrong order.
    #[error("box: min_m must be finite and not exceed max_m, got {0:?} and {1:?}")]
    Corners([f64; 3], [f64; 3]),
    /// A corner that no map of this resolution reaches.
    #[error("box: {field} must lie within {min_m}..{end_m} m in each axis, as the map does, got {value:?}")]
    Range {
        /// The corner.
        field: &'static str,
        /// The corner, meters.
        value: [f64; 3],
        /// Smallest coordinate of the map, meters.
        min_m: f64,
        /// The largest.
        end_m: f64,
    },
    /// Too many voxels.
    #[error("box: {cells} voxels of level {level}, at most {most} are looked at")]
    Cells {
        /// Voxels of the box.
        cells: f64,
        /// The level.
        level: u32,
        /// Most voxels.
        most: usize,
    },
    /// A distance that is no number above 0, or too large.
    #[error(
        "standoff_m must lie above 0 and at most {max_m} m, {STANDOFF_VOXELS_MAX} voxels of level {level}, got {standoff_m}"
    )]
    Standoff {
        /// The distance, meters.
        standoff_m: f64,
        /// The largest one, meters.
        max_m: f64,
        /// The level.
        level: u32,
    },
}
