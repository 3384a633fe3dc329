//! The whole of what a map holds, for who begins to watch it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Weak};

use super::recent_changes::BLOCKS_PER_PART;
use super::resource_budget::Reservation;
use super::{BlockBytes, StatePart};
use crate::map::{ContentVersion, KeepOuts, MapSettings};
use crate::sync::{Mutex, Rank};
use crate::voxel::VoxelSet;

/// The voxels of a level and the keep-outs at one revision. Those who begin to watch at about the same time share it.
#[derive(Debug)]
pub(super) struct FullState {
    pub(super) version: ContentVersion,
    pub(super) level: u32,
    pub(super) voxels: VoxelSet,
    pub(super) keep_outs: Arc<KeepOuts>,
    pub(super) _memory: Reservation,
}

/// The states that somebody is being told of, by their form.
#[derive(Debug)]
pub(super) struct FullStates(Mutex<BTreeMap<Option<u32>, Weak<FullState>>>);

/// What is still to be told of a state.
#[derive(Debug)]
pub(super) struct StateParts {
    state: Arc<FullState>,
    resolution_m: f64,
    levels: u32,
    /// The first block of the next part; none behind the last.
    next: Option<usize>,
}

impl Default for FullStates {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, BTreeMap::new()))
    }
}

impl FullStates {
    /// The state that was put there last under `key`, while somebody holds it.
    pub(super) fn get(&self, key: Option<u32>) -> Option<Arc<FullState>> {
        self.0.lock().get(&key).and_then(Weak::upgrade)
    }

    /// Puts a state there.
    pub(super) fn put(&self, key: Option<u32>, state: &Arc<FullState>) {
        let mut states = self.0.lock();
        states.retain(|_, state| state.strong_count() > 0);
        states.insert(key, Arc::downgrade(state));
    }
}

impl StateParts {
    /// What there is to tell of a state of a map of `settings`.
    pub(super) fn of(state: Arc<FullState>, settings: &MapSettings) -> Self {
        Self { state, resolution_m: settings.resolution_m, levels: settings.levels, next: Some(0) }
    }
}

impl Iterator for StateParts {
    type Item = StatePart;

    fn next(&mut self) -> Option<StatePart> {
        let blocks = self.state.voxels.blocks();
        let Range { start, end } = self.next.map(|start| start..blocks.len().min(start + BLOCKS_PER_PART))?;
        self.next = (end < blocks.len()).then_some(end);
        let keep_outs = if start == 0 { self.state.keep_outs.iter().cloned().collect() } else { Vec::new() };
        Some(StatePart {
            is_first: start == 0,
            is_last: self.next.is_none(),
            version: self.state.version,
            resolution_m: self.resolution_m,
            levels: self.levels,
            level: self.state.level,
            voxels: BlockBytes::of(&blocks[start..end]),
            keep_outs,
        })
    }
}
