//! Occupancy queries and listings, and their answers.

use bytes::Bytes;
use uuid::Uuid;

use super::point_cloud::PointCloud;
use super::version::MapVersion;
use mrol_map::geometry::Pose;
use mrol_map::map::{Lookup, Region, VoxelSelection};
use mrol_map::voxel::VoxelKey;

/// Are these points in occupied voxels?
#[derive(Debug, Clone)]
pub struct PointQuery {
    /// In the frame of `map_from_points`.
    pub points: PointCloud,
    /// Places the points in the map; identity where none.
    pub map_from_points: Option<Pose>,
    /// 0 is the finest.
    pub level: u32,
    /// By the exact set or by the filter alone.
    pub lookup: Lookup,
    /// Wait for this revision.
    pub min_revision: Option<u64>,
    /// The incarnation that `min_revision` belongs to.
    pub map_uuid: Option<Uuid>,
    /// Points in keep-outs count as occupied.
    pub keep_out: bool,
}

/// The answer to a [`PointQuery`], all at one revision.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointAnswer {
    /// Point i is bit i % 8 (lowest first) of byte i / 8.
    pub occupied: Bytes,
    /// Number of points answered.
    pub points: usize,
    /// How many of the points are occupied.
    pub points_occupied: usize,
    /// At this state.
    pub version: MapVersion,
}

/// Which occupied voxels of a level are there, or how many?
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ListingRequest {
    /// 0 is the finest.
    pub level: u32,
    /// Which of its voxels.
    pub selection: VoxelSelection,
    /// Voxels whose centers lie in keep-outs count as occupied.
    pub keep_out: bool,
    /// Count them, and list none: any number may be counted.
    pub count_only: bool,
}

impl ListingRequest {
    /// All voxels of a level, in a region or everywhere.
    pub fn of(level: u32, region: Option<Region>) -> Self {
        Self { level, selection: region.into(), ..Self::default() }
    }
}

/// The occupied voxels of a level.
#[derive(Debug, Clone)]
pub struct VoxelListing {
    /// The side of the voxels, meters.
    pub resolution_m: f64,
    /// How many they are.
    pub voxels_total: usize,
    /// In no order; none where they were to be counted.
    pub keys: Vec<VoxelKey>,
    /// At this state.
    pub version: MapVersion,
}
