//! Deletions of voxels, and their answers.

use super::point_cloud::PointCloud;
use super::version::MapVersion;
use crate::map::{Region, RequestId};
use crate::voxel::VoxelKey;

/// Which voxels to take out.
#[derive(Debug, Clone)]
pub struct Deletion {
    /// Which.
    pub target: DeletionTarget,
    /// At this level: all descendants go.
    pub level: u32,
    /// The caller's own id of this deletion; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// The ways to name voxels.
#[derive(Debug, Clone)]
pub enum DeletionTarget {
    /// The voxels that these points (map frame, meters) fall in.
    Points(PointCloud),
    /// By key, of the deletion's level.
    Keys(Vec<VoxelKey>),
    /// The voxels whose centers lie inside.
    Region(Region),
}

/// What a deletion did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeletionAnswer {
    /// Finest voxels removed.
    pub removed: usize,
    /// After it.
    pub version: MapVersion,
    /// True of a deletion that was done before under its id: this is that answer.
    pub replayed: bool,
}
