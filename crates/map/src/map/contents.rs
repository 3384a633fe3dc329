//! All that a map holds, at one revision: what is kept of it, and a map from what was kept.

use std::sync::Arc;

use super::change::IdempotencyLog;
use super::content_hash::{ContentHash, ContentVersion};
use super::keep_out::{KEEP_OUTS_MAX, KeepOuts};
use super::multi_resolution_map::MultiResolutionMap;
use super::settings::{MapSettings, MapSettingsError};
use super::trajectory::Trajectory;
use crate::util::StopSignal;
use crate::visibility::ViewpointSet;
use crate::voxel::{MomentSet, VoxelSet};

/// The largest revision, 2^53: the last whole number up to which every program that reads JSON counts exactly. A map
/// that changes a thousand times a second gets there in 285,000 years.
pub const REVISION_MAX: u64 = 1 << 53;

/// Why contents are those of no map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ContentsError {
    /// A revision that no map reaches.
    #[error("revision {0}, at most {REVISION_MAX} is possible")]
    Revision(u64),
    /// Revisions that do not ascend, or lie beyond the map's.
    #[error("the revisions of its {what} must ascend to at most {revision}")]
    Order {
        /// Whose they are.
        what: &'static str,
        /// The map's.
        revision: u64,
    },
    /// More keep-outs than a map has.
    #[error("{0} keep-outs, a map has at most {KEEP_OUTS_MAX}")]
    KeepOuts(usize),
    /// A keep-out that was made at a revision beyond the map's.
    #[error("the keep-out {0} was made at revision {1}, the map is at {2}")]
    KeepOutRevision(String, u64, u64),
    /// A viewpoint of a revision beyond the map's.
    #[error("a viewpoint of revision {0}, the map is at {1}")]
    ViewpointRevision(u64, u64),
}

/// What a map holds at one revision, besides its settings. Coarser levels and filters follow from the finest
/// voxels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapContents {
    /// Committed changes so far.
    pub revision: u64,
    /// The finest voxels.
    pub voxels: VoxelSet,
    /// Moments of the points in the voxels; none of a map that keeps none.
    pub moments: MomentSet,
    /// The accepted scans.
    pub trajectory: Trajectory,
    /// Answers to changes that were asked for under an id.
    pub requests: IdempotencyLog,
    /// Where no robot may go.
    pub keep_outs: Arc<KeepOuts>,
    /// Where scans saw through.
    pub viewpoints: Arc<ViewpointSet>,
}

impl MapContents {
    /// Voxels alone, at a revision; their centers stand for the points.
    pub fn at(revision: u64, voxels: VoxelSet) -> Self {
        Self { revision, moments: MomentSet::of_centers(&voxels), voxels, ..Self::default() }
    }

    /// The revision, with the hash of the voxels.
    pub fn version(&self) -> ContentVersion {
        ContentVersion { revision: self.revision, hash: ContentHash::of(&self.voxels) }
    }

    /// These contents, when a map can hold them: what came from elsewhere is asked.
    ///
    /// # Errors
    /// When revisions are out of range or out of order, or there are more keep-outs than a map has.
    pub fn checked(self) -> Result<Self, ContentsError> {
        if self.revision > REVISION_MAX {
            return Err(ContentsError::Revision(self.revision));
        }
        let (scans, withdrawn) = (self.trajectory.stored(), self.trajectory.withdrawn());
        self.check_order("scans", scans.map(|scan| scan.revision))?;
        self.check_order("withdrawn changes", withdrawn.iter().map(|withdrawn| withdrawn.revision))?;
        self.check_order("requests", self.requests.iter().map(|request| request.revision))?;
        self.check_keep_outs()?;
        if let Some((late, _)) = self.viewpoints.iter().last().filter(|(last, _)| *last > self.revision) {
            return Err(ContentsError::ViewpointRevision(late, self.revision));
        }
        Ok(self)
    }

    fn check_keep_outs(&self) -> Result<(), ContentsError> {
        if self.keep_outs.len() > KEEP_OUTS_MAX {
            return Err(ContentsError::KeepOuts(self.keep_outs.len()));
        }
        match self.keep_outs.iter().find(|keep_out| keep_out.made_revision > self.revision) {
            None => Ok(()),
            Some(late) => {
                let (name, made) = (late.name.to_string(), late.made_revision);
                Err(ContentsError::KeepOutRevision(name, made, self.revision))
            }
        }
    }

    fn check_order(
        &self,
        what: &'static str,
        revisions: impl Iterator<Item = u64>,
    ) -> Result<(), ContentsError> {
        let ascend = revisions.chain([self.revision]).is_sorted();
        ascend.then_some(()).ok_or(ContentsError::Order { what, revision: self.revision })
    }
}

impl MultiResolutionMap {
    /// Takes the picture of this map. Changes wait while it is taken, readers do not.
    pub fn contents(&self) -> MapContents {
        self.taken_until(StopSignal::NEVER)
    }

    /// [`MultiResolutionMap::contents`] under a stop signal; none once stopped.
    pub fn contents_until(&self, stop: StopSignal<'_>) -> Option<MapContents> {
        Some(self.taken_until(stop)).filter(|_| !stop.is_stopped())
    }

    /// Some of it, once stopped.
    fn taken_until(&self, stop: StopSignal<'_>) -> MapContents {
        let long = self.long_read();
        let (moments, view) = (long.moments(), long.view());
        // Every change of the trajectory or the requests holds a shard meanwhile, or the keep-outs, so that all of them
        // are of one revision.
        let locked = self.keep_outs.read();
        let (revision, keep_outs) = (self.revision(), Arc::clone(&locked));
        let (viewpoints, trajectory, requests) =
            (self.viewpoints(), self.trajectory(), self.requests().clone());
        drop(locked);
        let moments = moments.map_or_else(MomentSet::default, |moments| moments.to_set_until(stop));
        let voxels = view.voxels_until(stop);
        MapContents { revision, voxels, moments, trajectory, requests, keep_outs, viewpoints }
    }

    /// The map of `settings` that holds `contents`, without their moments where it keeps none.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn restore(settings: MapSettings, contents: MapContents) -> Result<Self, MapSettingsError> {
        let map = Self::new(settings)?;
        map.fill_until(contents, StopSignal::NEVER);
        Ok(map)
    }

    /// [`MultiResolutionMap::restore`] under a stop signal; none once stopped.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn restore_until(
        settings: MapSettings,
        contents: MapContents,
        stop: StopSignal<'_>,
    ) -> Result<Option<Self>, MapSettingsError> {
        let map = Self::new(settings)?;
        Ok(map.fill_until(contents, stop).then_some(map))
    }

    /// Fills an empty map; false once stopped.
    fn fill_until(&self, contents: MapContents, stop: StopSignal<'_>) -> bool {
        let Some(hash) = self.committer().add(contents.voxels, contents.moments, stop) else {
            return false;
        };
        *self.trajectory.write() = contents.trajectory;
        *self.requests.write() = contents.requests;
        *self.keep_outs.write() = contents.keep_outs;
        *self.viewpoints.write() = contents.viewpoints;
        self.published.publish(ContentVersion { revision: contents.revision, hash });
        true
    }
}
