//! The whole of what a map holds, for who begins to watch it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Weak};

use super::recent_changes::BLOCKS_PER_PART;
use super::{BlockBytes, StatePart};
use crate::map::{ContentVersion, KeepOuts, Region, blocks_in};
use crate::sync::{Mutex, Rank};
use crate::voxel::{Lattice, VoxelSet};

/// Parts without a voxel in the region that are passed over at once.
const PARTS_PASSED_OVER_MAX: usize = 32;

/// The voxels of a level and the keep-outs at one revision. Those who begin to watch at about the same time share it.
#[derive(Debug)]
pub(super) struct FullState {
    pub(super) version: ContentVersion,
    pub(super) level: u32,
    pub(super) voxels: VoxelSet,
    pub(super) keep_outs: Arc<KeepOuts>,
}

/// The states that somebody is being told of, by their form.
#[derive(Debug)]
pub(super) struct FullStates(Mutex<BTreeMap<Option<u32>, Weak<FullState>>>);

/// What is still to be told of a state.
#[derive(Debug)]
pub(super) struct StateParts {
    state: Arc<FullState>,
    /// The part that is told; everything without.
    region: Option<Region>,
    lattice: Lattice,
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
    /// What there is to tell of a state of a map with this lattice, of the part of it in `region` where there is one.
    pub(super) fn of(state: Arc<FullState>, region: Option<Region>, lattice: &Lattice) -> Self {
        Self { state, region, lattice: *lattice, next: Some(0) }
    }

    /// The blocks of the next part, with the place of the first one. Parts without a voxel in the region are passed over, but
    /// not so many that it would keep a thread of the runtime.
    fn next_blocks(&mut self) -> Option<(usize, BlockBytes)> {
        let all = self.state.voxels.blocks();
        let first = self.next?;
        for start in (first..).step_by(BLOCKS_PER_PART).take(PARTS_PASSED_OVER_MAX) {
            let Range { start, end } = start..all.len().min(start + BLOCKS_PER_PART);
            self.next = (end < all.len()).then_some(end);
            let blocks = &all[start..end];
            let blocks = match &self.region {
                None => BlockBytes::of(blocks),
                Some(region) => BlockBytes::of(&blocks_in(blocks, region, &self.lattice, self.state.level)),
            };
            if !blocks.is_empty() || self.next.is_none() {
                return Some((first, blocks));
            }
        }
        Some((first, BlockBytes::default()))
    }
}

impl Iterator for StateParts {
    type Item = StatePart;

    fn next(&mut self) -> Option<StatePart> {
        let (first, voxels) = self.next_blocks()?;
        let keep_outs = if first == 0 { self.state.keep_outs.iter().cloned().collect() } else { Vec::new() };
        Some(StatePart {
            is_first: first == 0,
            is_last: self.next.is_none(),
            version: self.state.version,
            resolution_m: self.lattice.resolution_m(0),
            levels: self.lattice.levels(),
            level: self.state.level,
            voxels,
            keep_outs,
        })
    }
}
