//! What a map knows of the points in its voxels.

use crate::map::{MomentsView, MultiResolutionMap};
use crate::voxel::{Moments, VoxelKey};

/// Where moments come from.
#[derive(Debug)]
pub(super) enum KnownMoments<'a> {
    /// From the points, of a map that keeps moments; they do not change meanwhile.
    OfPoints(MomentsView<'a>),
    /// From the centers of the finest voxels, as they are when they are asked for.
    OfCenters(&'a MultiResolutionMap),
}

impl<'a> KnownMoments<'a> {
    /// What there is of `map`.
    pub(super) fn of(map: &'a MultiResolutionMap) -> Self {
        map.moments().map_or(Self::OfCenters(map), Self::OfPoints)
    }

    /// The moments in a voxel of [`MOMENT_LEVEL`](crate::voxel::MOMENT_LEVEL); none where there is no point.
    pub(super) fn in_voxel(&self, voxel: VoxelKey) -> Option<Moments> {
        match self {
            Self::OfPoints(moments) => moments.of(voxel).copied(),
            Self::OfCenters(map) => map.center_moments(voxel),
        }
    }
}
