//! A map from what was kept of it.

use std::sync::atomic::Ordering;

use super::{MapSettings, MapSettingsError, MultiResolutionMap, TrajectoryPose};
use crate::voxel::VoxelSet;

impl MultiResolutionMap {
    /// The map of `settings` at `revision` with these finest voxels and poses. Coarser levels and filters
    /// follow from the finest voxels.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn restore(
        settings: MapSettings,
        revision: u64,
        voxels: &VoxelSet,
        poses: impl IntoIterator<Item = TrajectoryPose>,
    ) -> Result<Self, MapSettingsError> {
        let map = Self::new(settings)?;
        map.committer().add(voxels);
        *map.trajectory.write() = poses.into_iter().collect();
        map.revision.store(revision, Ordering::Release);
        Ok(map)
    }
}
