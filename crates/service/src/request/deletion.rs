//! Deletions of voxels, and their answers.

use super::point_cloud::PointCloud;
use super::version::MapVersion;
use crate::error::{Reason, ServiceError};
use mrol_map::map::{Region, RequestId};
use mrol_map::voxel::VoxelKey;

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
    /// Those of a region that were not seen any more.
    NotSeenSince(NotSeenSince),
}

/// The voxels of a region that no scan touched after a revision, although a viewpoint after it saw through them: what
/// was taken away.
#[derive(Debug, Clone, PartialEq)]
pub struct NotSeenSince {
    /// The voxels whose centers lie inside.
    pub region: Region,
    /// Within the undo window.
    pub revision: u64,
}

impl DeletionTarget {
    /// This target, or of its region only what was not seen since a revision, where one is given.
    ///
    /// # Errors
    /// For a revision without a region.
    pub fn not_seen_since(self, revision: Option<u64>) -> Result<Self, ServiceError> {
        match (self, revision) {
            (target, None) => Ok(target),
            (Self::Region(region), Some(revision)) => {
                Ok(Self::NotSeenSince(NotSeenSince { region, revision }))
            }
            (_, Some(revision)) => {
                let message = format!(
                    "not_seen_since is {revision}, and needs a region: a box, an oriented box or a sphere"
                );
                Err(ServiceError::new(Reason::BadRevision, message))
            }
        }
    }
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
