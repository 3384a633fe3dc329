//! The whole of what a map holds, in parts as it is told.

use std::ops::Range;
use std::sync::Arc;

use crate::commit::{BLOCKS_PER_PART, Watched, has_looked_into};
use crate::maps::FullState;
use crate::request::{BlockBytes, StatePart, WatchedViewpoint};
use mrol_map::map::blocks_in;
use mrol_map::voxel::Lattice;

/// Parts without a voxel in the region that are passed over at once.
const PARTS_PASSED_OVER_MAX: usize = 32;

/// What is still to be told of a state.
#[derive(Debug)]
pub(super) struct StateParts {
    state: Arc<FullState>,
    watched: Watched,
    lattice: Lattice,
    is_begun: bool,
    /// None behind the last part.
    next: Option<NextPart>,
}

/// Where the next part begins.
#[derive(Debug, Clone, Copy)]
enum NextPart {
    /// With this block.
    Block(usize),
    /// With the viewpoint of this revision, or the one after it.
    Viewpoint(u64),
}

impl StateParts {
    /// The messages of a state of a map with this lattice, for a watcher that asked for this.
    pub(super) fn of(state: Arc<FullState>, watched: Watched, lattice: &Lattice) -> Self {
        Self { state, watched, lattice: *lattice, is_begun: false, next: Some(NextPart::Block(0)) }
    }

    /// The blocks of the part that begins with `first`. Parts without a voxel in the region are passed over, but not so
    /// many that it would keep a thread of the runtime.
    fn take_blocks(&mut self, first: usize) -> BlockBytes {
        let all = self.state.voxels.blocks();
        for start in (first..).step_by(BLOCKS_PER_PART).take(PARTS_PASSED_OVER_MAX) {
            let Range { start, end } = start..all.len().min(start + BLOCKS_PER_PART);
            self.next = match end < all.len() {
                true => Some(NextPart::Block(end)),
                false => self.viewpoints_from(0),
            };
            let blocks = &all[start..end];
            let blocks = match &self.watched.region {
                None => BlockBytes::of(blocks),
                Some(region) => BlockBytes::of(&blocks_in(blocks, region, &self.lattice, self.state.level)),
            };
            if !blocks.is_empty() || end == all.len() {
                return blocks;
            }
        }
        BlockBytes::default()
    }

    /// The viewpoints of the part that begins with that of revision `first`: as many bytes as of blocks, and few that
    /// lie elsewhere.
    fn take_viewpoints(&mut self, first: u64) -> Vec<WatchedViewpoint> {
        let (mut told, mut bytes) = (Vec::new(), 0);
        self.next = None;
        for (i, (revision, viewpoint)) in self.state.viewpoints.iter_from(first).enumerate() {
            bytes += viewpoint.image().stored_bytes();
            if i > 0 && bytes > BLOCKS_PER_PART * BlockBytes::OF_BLOCK {
                self.next = Some(NextPart::Viewpoint(revision));
                break;
            }
            if self.watched.region.is_none_or(|region| has_looked_into(viewpoint, &region)) {
                told.push(WatchedViewpoint {
                    revision,
                    map_from_sensor: *viewpoint.map_from_sensor(),
                    image: viewpoint.image().to_bytes().into(),
                });
            }
        }
        told
    }

    /// Where viewpoints from `revision` on come next, if they do.
    fn viewpoints_from(&self, revision: u64) -> Option<NextPart> {
        let is_next = self.watched.viewpoints && self.state.viewpoints.iter_from(revision).next().is_some();
        is_next.then_some(NextPart::Viewpoint(revision))
    }
}

impl Iterator for StateParts {
    type Item = StatePart;

    fn next(&mut self) -> Option<StatePart> {
        let (voxels, viewpoints) = match self.next? {
            NextPart::Block(first) => (self.take_blocks(first), Vec::new()),
            NextPart::Viewpoint(first) => (BlockBytes::default(), self.take_viewpoints(first)),
        };
        let is_first = !std::mem::replace(&mut self.is_begun, true);
        let keep_outs = if is_first { self.state.keep_outs.iter().cloned().collect() } else { Vec::new() };
        Some(StatePart {
            is_first,
            is_last: self.next.is_none(),
            version: self.state.version,
            resolution_m: self.lattice.resolution_m(0),
            levels: self.lattice.levels(),
            level: self.state.level,
            voxels,
            keep_outs,
            viewpoints,
        })
    }
}
