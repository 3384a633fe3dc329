//! A copy of a map that is built of the messages of a watch.

use std::sync::{Arc, OnceLock};

use uuid::Uuid;

use super::{ReplicaError, ReplicaOptions};
use crate::bloom::FilterSettings;
use crate::map::{
    Change, ContentHash, ContentVersion, KEEP_OUTS_MAX, KeepOutRecord, KeepOuts, MapContents, MapSettings,
    MultiResolutionMap,
};
use crate::planning::Planner;
use crate::service::{Cause, ChangePart, StatePart, WatchEvent, WatchMessage};
use crate::voxel::{BlockMask, VoxelKey, VoxelSet};

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

/// Builds the copy. What a server sends is not believed: revisions must follow each other, sizes are bounded, and where the
/// whole map is copied, every hash that the server tells must be that of the copy.
#[derive(Debug)]
pub(super) struct Builder {
    /// Finest blocks that the copy, or one change, may have.
    blocks_max: usize,
    /// Filters of the copy.
    filter: Option<FilterSettings>,
    /// True of a copy of the whole map, whose hash can be compared.
    is_whole: bool,
    copied: Option<Copied>,
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
        let ReplicaOptions { region, blocks_max, filter, .. } = *options;
        Self { blocks_max, filter, is_whole: region.is_none(), copied: None, state: None, change: None }
    }

    /// What was copied last.
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

    /// Applies a message. Takes as long as the change is large, and waits for who reads the copy.
    ///
    /// # Errors
    /// For a message that cannot follow on those before it.
    pub(super) fn apply(&mut self, message: WatchMessage) -> Result<Applied, ReplicaError> {
        let WatchMessage { map_uuid, event, .. } = message;
        match event {
            WatchEvent::Heartbeat => Ok(Applied::Nothing),
            WatchEvent::State(part) => self.take_state(map_uuid, part),
            WatchEvent::Change(part) => self.take_change(map_uuid, part),
        }
    }

    fn take_state(&mut self, map_uuid: Uuid, part: StatePart) -> Result<Applied, ReplicaError> {
        if part.is_first {
            let settings = MapSettings::query_only(part.resolution_m, part.levels);
            let settings = MapSettings { filter: self.filter, ..settings }.checked();
            let settings = settings.map_err(|e| damaged(format!("the map's settings: {e}")))?;
            let (version, blocks) = (part.version, Vec::new());
            let keep_outs = Arc::new(part.keep_outs.into_iter().collect());
            self.change = None;
            self.state = Some(StateSoFar { map_uuid, settings, version, blocks, keep_outs });
        }
        let state = self.state.as_mut().ok_or_else(|| damaged("a state without its first part"))?;
        if (state.map_uuid, state.version) != (map_uuid, part.version) || part.level != 0 {
            return Err(damaged("a state whose parts are of several versions, or not of level 0"));
        }
        let voxels = part.voxels.to_set().map_err(|e| damaged(e.message))?;
        extend(&mut state.blocks, &voxels, self.blocks_max)?;
        let Some(state) = self.state.take_if(|_| part.is_last) else {
            return Ok(Applied::Nothing);
        };
        let StateSoFar { map_uuid, settings, version, blocks, keep_outs } = state;
        let voxels: VoxelSet = blocks.into_iter().collect();
        self.check_hash(ContentHash::of(&voxels), Some(version.hash))?;
        let contents =
            MapContents { revision: version.revision, voxels, keep_outs, ..MapContents::default() };
        let contents = contents.checked().map_err(|e| damaged(e.to_string()))?;
        let map = MultiResolutionMap::restore(settings, contents);
        let map = Arc::new(map.map_err(|e| damaged(format!("the map's settings: {e}")))?);
        let copied = Copied { map, map_uuid, planner: Arc::default() };
        self.copied = Some(copied.clone());
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
            Cause::Scan(_) | Cause::Deletion | Cause::Undo { .. } => {
                map.committer().exchange(&removed, &added)
            }
        };
        self.check_hash(committed.hash, part.content_hash)?;
        Ok(Applied::Changed)
    }

    fn check_hash(&self, own: ContentHash, told: Option<ContentHash>) -> Result<(), ReplicaError> {
        match told.filter(|told| self.is_whole && *told != own) {
            None => Ok(()),
            Some(told) => Err(damaged(format!("the copy's hash is {own}, and the map's {told}"))),
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

fn damaged(what: impl Into<String>) -> ReplicaError {
    ReplicaError::Damaged(what.into())
}
