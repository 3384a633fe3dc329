//! What a map knows of the points in its voxels.

use crate::map::{MomentsView, MultiResolutionMap};
use crate::voxel::{Moments, VoxelKey};

/// The moments of a map's points; of one that keeps none, those of the centers of its finest voxels, as they are when
/// they are asked for.
#[derive(Debug)]
pub(in crate::align) struct KnownMoments<'a> {
    map: &'a MultiResolutionMap,
    kept: Option<MomentsView<'a>>,
}

impl<'a> KnownMoments<'a> {
    /// What there is of `map`; moments that it keeps do not change meanwhile.
    pub(in crate::align) fn of(map: &'a MultiResolutionMap) -> Self {
        Self { map, kept: map.moments() }
    }

    /// The moments in a voxel of [`MOMENT_LEVEL`](crate::voxel::MOMENT_LEVEL); none where there is no point.
    pub(super) fn in_voxel(&self, voxel: VoxelKey) -> Option<Moments> {
        match &self.kept {
            Some(moments) => moments.of(voxel).copied(),
            None => self.map.center_moments(voxel),
        }
    }
}
