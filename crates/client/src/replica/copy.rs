//! A copy of a map that is built of the messages of a watch.

use std::sync::{Arc, OnceLock};

use uuid::Uuid;

use super::error::ReplicaError;
use super::options::ReplicaOptions;
use mrol_map::bloom::FilterSettings;
use mrol_map::geometry::Pose;
use mrol_map::map::{
    Change, ContentHash, ContentVersion, KEEP_OUTS_MAX, KeepOutRecord, KeepOuts, MapContents, MapSettings,
    MultiResolutionMap, StateHash, ViewpointChange,
};
use mrol_map::planning::Planner;
use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Viewpoint, ViewpointSet};
use mrol_map::voxel::{BlockMask, VoxelKey, VoxelSet};
use mrol_service::{
    Cause, ChangePart, LeftViewpoint, StatePart, WatchEvent, WatchMessage, WatchedSince, WatchedViewpoint,
};

/// A map as a replica has it.
#[derive(Debug, Clone)]
pub(super) struct Copied {
    pub(super) map: Arc<MultiResolutionMap>,
    pub(super) map_uuid: Uuid,
    /// What makes checks of bodies fast, once somebody asked for one.
    pub(super) planner: Arc<OnceLock<Planner>>,
}

/// What a message did to the copy.
#[derive(Debug)]
pub(super) enum Applied {
    /// Nothing yet: it was a part, or a heartbeat.
    Nothing,
    /// There is another map in its place.
    Replaced(Copied),
    /// It has a new revision.
    Changed,
}

/// Builds the copy. What a server sends is not believed: revisions must follow each other, sizes are bounded, and where
/// the whole map is copied, every hash that the server tells must be that of the copy.
#[derive(Debug)]
pub(super) struct Builder {
    /// Finest blocks that the copy, or one change, may have.
    blocks_max: usize,
    /// Bytes of viewpoints that it may have.
    viewpoint_bytes_max: usize,
    /// Filters of the copy.
    filter: Option<FilterSettings>,
    /// True of a copy of the whole map, whose hash can be compared.
    is_whole: bool,
    copied: Option<Copied>,
    /// The hash of what the whole map holds at the copy's revision, where the server told it.
    map_hash: Option<ContentHash>,
    /// The hash of all that a copy may hold at the copy's revision, where the server told it.
    state_hash: Option<StateHash>,
    state: Option<StateSoFar>,
    change: Option<ChangeSoFar>,
}

#[derive(Debug)]
struct StateSoFar {
    map_uuid: Uuid,
    settings: MapSettings,
    version: ContentVersion,
    blocks: Vec<(VoxelKey, BlockMask)>,
    keep_outs: Arc<KeepOuts>,
    viewpoints: ViewpointSet,
}

#[derive(Debug)]
struct ChangeSoFar {
    revision: u64,
    removed: Vec<(VoxelKey, BlockMask)>,
    added: Vec<(VoxelKey, BlockMask)>,
}

impl Builder {
    /// Nothing is copied yet.
    pub(super) fn new(options: &ReplicaOptions) -> Self {
        let ReplicaOptions { region, blocks_max, viewpoint_bytes_max, filter, .. } = *options;
        Self {
            blocks_max,
            viewpoint_bytes_max,
            filter,
            is_whole: region.is_none(),
            copied: None,
            map_hash: None,
            state_hash: None,
            state: None,
            change: None,
        }
    }

    /// What the copy has, for a server to go on from.
    pub(super) fn since(&self) -> Option<WatchedSince> {
        let Copied { map, map_uuid, .. } = self.copied.as_ref()?;
        let ContentVersion { revision, hash } = map.content_version();
        let content_hash = if self.is_whole { Some(hash) } else { self.map_hash };
        Some(WatchedSince { revision, map_uuid: *map_uuid, content_hash, state_hash: self.state_hash })
    }

    /// What was copied last.
    #[cfg(test)]
    pub(super) fn copied(&self) -> Option<&Copied> {
        self.copied.as_ref()
    }

    /// Forgets what is not whole yet: another watch begins.
    pub(super) fn begin(&mut self) {
        (self.state, self.change) = (None, None);
    }

    /// Forgets the copy: the next watch tells of the whole state.
    pub(super) fn forget(&mut self) {
        self.begin();
        self.copied = None;
    }

    /// Applies a message. Takes time in proportion to the change, and waits for readers of the copy.
    ///
    /// # Errors
    /// For a message that cannot follow on those before it.
    pub(super) fn apply(&mut self, message: WatchMessage) -> Result<Applied, ReplicaError> {
        let WatchMessage { map_uuid, state_hash, event, .. } = message;
        let applied = match event {
            WatchEvent::Heartbeat => Applied::Nothing,
            WatchEvent::State(part) => self.take_state(map_uuid, part)?,
            WatchEvent::Change(part) => self.take_change(map_uuid, part)?,
        };
        if !matches!(applied, Applied::Nothing) {
            self.state_hash = state_hash;
        }
        Ok(applied)
    }

    fn take_state(&mut self, map_uuid: Uuid, part: StatePart) -> Result<Applied, ReplicaError> {
        if part.is_first {
            let settings = MapSettings::query_only(part.resolution_m, part.levels);
            let settings = MapSettings { filter: self.filter, ..settings }.checked();
            let settings = settings.map_err(|e| damaged(format!("the map's settings: {e}")))?;
            let (version, blocks) = (part.version, Vec::new());
            let keep_outs = Arc::new(part.keep_outs.into_iter().collect());
            self.change = None;
            let viewpoints = ViewpointSet::default();
            self.state = Some(StateSoFar { map_uuid, settings, version, blocks, keep_outs, viewpoints });
        }
        let state = self.state.as_mut().ok_or_else(|| damaged("a state without its first part"))?;
        if (state.map_uuid, state.version) != (map_uuid, part.version) || part.level != 0 {
            return Err(damaged("a state whose parts are of several versions, or not of level 0"));
        }
        let voxels = part.voxels.to_set().map_err(|e| damaged(e.message))?;
        extend(&mut state.blocks, &voxels, self.blocks_max)?;
        for WatchedViewpoint { revision, map_from_sensor, image } in part.viewpoints {
            let viewpoint = viewpoint_of(map_from_sensor, &image)?;
            state.viewpoints.insert(revision, viewpoint);
            check_bytes(state.viewpoints.memory_bytes(), self.viewpoint_bytes_max)?;
        }
        let Some(state) = self.state.take_if(|_| part.is_last) else {
            return Ok(Applied::Nothing);
        };
        let StateSoFar { map_uuid, settings, version, blocks, keep_outs, viewpoints } = state;
        let voxels: VoxelSet = blocks.into_iter().collect();
        let hash = ContentHash::of(&voxels);
        if self.is_whole && hash != version.hash {
            return Err(damaged(format!("the state's hash is {hash}, and the map's {}", version.hash)));
        }
        let (revision, viewpoints) = (version.revision, Arc::new(viewpoints));
        let contents = MapContents { revision, voxels, keep_outs, viewpoints, ..MapContents::default() };
        let contents = contents.checked().map_err(|e| damaged(e.to_string()))?;
        let map = MultiResolutionMap::restore(settings, contents);
        let map = Arc::new(map.map_err(|e| damaged(format!("the map's settings: {e}")))?);
        let copied = Copied { map, map_uuid, planner: Arc::default() };
        (self.copied, self.map_hash) = (Some(copied.clone()), Some(version.hash));
        Ok(Applied::Replaced(copied))
    }

    fn take_change(&mut self, map_uuid: Uuid, part: ChangePart) -> Result<Applied, ReplicaError> {
        let copied =
            self.copied.as_ref().filter(|copied| copied.map_uuid == map_uuid && self.state.is_none());
        let map =
            copied.map(|copied| Arc::clone(&copied.map)).ok_or_else(|| damaged("a change of no state"))?;
        let (revision, next) = (part.revision, map.revision() + 1);
        let change = self.change.get_or_insert_with(|| ChangeSoFar {
            revision,
            removed: Vec::new(),
            added: Vec::new(),
        });
        if revision != next || change.revision != revision {
            return Err(damaged(format!("revision {revision}, where {next} comes next")));
        }
        let [removed, added] = [part.removed, part.added].map(|voxels| voxels.to_set());
        extend(&mut change.removed, &removed.map_err(|e| damaged(e.message))?, self.blocks_max)?;
        extend(&mut change.added, &added.map_err(|e| damaged(e.message))?, self.blocks_max)?;
        let Some(ChangeSoFar { removed, added, .. }) = self.change.take_if(|_| part.is_last) else {
            return Ok(Applied::Nothing);
        };
        let [removed, added] = [removed, added].map(|blocks| blocks.into_iter().collect::<VoxelSet>());
        let committed = match part.cause {
            Cause::KeepOut(change) => {
                map.keep_outs()
                    .check_room_for(&change.name, KEEP_OUTS_MAX)
                    .map_err(|e| damaged(e.to_string()))?;
                map.committer().apply(&Change::KeepOut(KeepOutRecord { change, request: None }))
            }
            Cause::Scan(scan) => {
                let seen = self.seen(&map, &scan.map_from_sensor, part.viewpoint)?;
                map.committer().exchange_seen(&removed, &added, seen)
            }
            Cause::Undo { scans, .. } => {
                map.committer().exchange_seen(&removed, &added, ViewpointChange { left: None, gone: scans })
            }
            Cause::Deletion => map.committer().exchange(&removed, &added),
        };
        self.check_same(committed.version(), part.content_hash)?;
        self.map_hash = part.content_hash;
        Ok(Applied::Changed)
    }

    /// What becomes of the viewpoints with a scan that was taken at `map_from_sensor`.
    fn seen(
        &self,
        map: &MultiResolutionMap,
        map_from_sensor: &Pose,
        told: Option<LeftViewpoint>,
    ) -> Result<ViewpointChange, ReplicaError> {
        let Some(LeftViewpoint { image, displaced: gone }) = told else {
            return Ok(ViewpointChange::default());
        };
        let left = (!image.is_empty()).then(|| viewpoint_of(*map_from_sensor, &image)).transpose()?;
        let bytes = left.as_ref().map_or(0, |viewpoint| viewpoint.memory_bytes());
        check_bytes(map.viewpoints().memory_bytes() + bytes, self.viewpoint_bytes_max)?;
        Ok(ViewpointChange { left, gone })
    }

    /// Refuses to go on with a copy that is another than the map at the same revision.
    fn check_same(&self, own: ContentVersion, told: Option<ContentHash>) -> Result<(), ReplicaError> {
        let ContentVersion { revision, hash: copy } = own;
        match told.filter(|told| self.is_whole && *told != copy) {
            None => Ok(()),
            Some(map) => Err(ReplicaError::Diverged { revision, copy, map }),
        }
    }
}

fn extend(blocks: &mut Vec<(VoxelKey, BlockMask)>, more: &VoxelSet, most: usize) -> Result<(), ReplicaError> {
    if blocks.len() + more.blocks().len() > most {
        return Err(ReplicaError::TooLarge(most));
    }
    blocks.extend_from_slice(more.blocks());
    Ok(())
}

fn viewpoint_of(map_from_sensor: Pose, image: &[u8]) -> Result<Arc<Viewpoint>, ReplicaError> {
    if image.len() > IMAGE_BYTES_MAX {
        return Err(damaged(format!(
            "a range image of {} bytes, at most {IMAGE_BYTES_MAX} are one",
            image.len()
        )));
    }
    let image = RangeImage::from_bytes(image).map_err(|e| damaged(e.to_string()))?;
    Ok(Arc::new(Viewpoint::new(map_from_sensor, image)))
}

fn check_bytes(bytes: usize, most: usize) -> Result<(), ReplicaError> {
    if bytes > most { Err(ReplicaError::TooManyViewpoints(most)) } else { Ok(()) }
}

fn damaged(what: impl Into<String>) -> ReplicaError {
    ReplicaError::Damaged(what.into())
}
