//! Followers of the blocks of a map that change: structures that are derived of the voxels, and are to be mended where
//! those changed.

use std::sync::Arc;

use crate::sync::{Mutex, Rank};
use crate::voxel::{BlockMask, VoxelKey};

/// Blocks that a follower's queue holds; 72 bytes each. Beyond that it is told that everything may have changed, and
/// until it asks, no change costs anything for it.
const QUEUE_BLOCKS_MAX: usize = 64 << 10;

/// The blocks that changed, tier by tier: those of tier t are 8 x 8 x 8 voxels of level 3 t, and `changed` says which
/// of these came or went.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TouchedBlocks {
    /// Each block with the voxels that changed, at each tier.
    pub tiers: Vec<Vec<(VoxelKey, BlockMask)>>,
    /// True where it is not known what changed: anything may have.
    pub everything: bool,
}

impl TouchedBlocks {
    /// All blocks of a map, or of a part of it.
    pub(in crate::map) fn everything() -> Self {
        Self { tiers: Vec::new(), everything: true }
    }

    /// True where nothing changed.
    pub fn is_empty(&self) -> bool {
        !self.everything && self.tiers.iter().all(Vec::is_empty)
    }

    fn len(&self) -> usize {
        self.tiers.iter().map(Vec::len).sum()
    }

    /// Adds what another part of the map, or a later change, touched.
    pub(in crate::map) fn extend(&mut self, other: &Self) {
        self.everything |= other.everything;
        if self.tiers.len() < other.tiers.len() {
            self.tiers.resize_with(other.tiers.len(), Vec::new);
        }
        for (tier, blocks) in self.tiers.iter_mut().zip(&other.tiers) {
            tier.extend_from_slice(blocks);
        }
    }

    /// Each block once, ascending, with the voxels that are not as they were before the first change.
    fn merged(mut self) -> Self {
        for tier in &mut self.tiers {
            tier.sort_unstable_by_key(|(block, _)| *block);
            tier.dedup_by(|later, kept| {
                let is_same = later.0 == kept.0;
                if is_same {
                    kept.1 = kept.1.symmetric_difference(&later.1);
                }
                is_same
            });
            tier.retain(|(_, changed)| !changed.is_empty());
        }
        self
    }
}

/// What waits for a follower, and what it says of itself.
#[derive(Debug, Default)]
struct Queue {
    follower: u64,
    /// The changes that wait, and how many blocks they touched.
    touched: Vec<Arc<TouchedBlocks>>,
    blocks: usize,
    /// True where something is not known, or was too much: then nothing waits.
    everything: bool,
    bytes: usize,
}

impl Queue {
    fn push(&mut self, touched: &Arc<TouchedBlocks>) {
        self.blocks += touched.len();
        self.everything |= touched.everything || self.blocks > QUEUE_BLOCKS_MAX;
        if self.everything {
            self.touched.clear();
        } else if !touched.is_empty() {
            self.touched.push(Arc::clone(touched));
        }
    }

    /// What waited.
    fn take(&mut self) -> (Vec<Arc<TouchedBlocks>>, bool) {
        self.blocks = 0;
        (std::mem::take(&mut self.touched), std::mem::take(&mut self.everything))
    }
}

#[derive(Debug, Default)]
struct Queues {
    next: u64,
    queues: Vec<Queue>,
}

/// The followers of a map.
#[derive(Debug)]
pub(in crate::map) struct Followers(Arc<Mutex<Queues>>);

impl Default for Followers {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(Rank::Brief, Queues::default())))
    }
}

impl Followers {
    /// A new follower, which is told of every change that comes from now on.
    pub(in crate::map) fn add(&self) -> BlockFollower {
        let mut queues = self.0.lock();
        let follower = queues.next;
        queues.next += 1;
        queues.queues.push(Queue { follower, ..Queue::default() });
        BlockFollower { follower, followers: Arc::clone(&self.0) }
    }

    /// True where a follower wants to know which blocks change.
    pub(in crate::map) fn want_blocks(&self) -> bool {
        self.0.lock().queues.iter().any(|queue| !queue.everything)
    }

    /// Tells all of a change. To be called while the locks of what changed are held.
    pub(in crate::map) fn tell(&self, touched: TouchedBlocks) {
        let touched = Arc::new(touched);
        self.0.lock().queues.iter_mut().for_each(|queue| queue.push(&touched));
    }

    /// Bytes of memory that the followers hold.
    pub(in crate::map) fn bytes(&self) -> usize {
        self.0.lock().queues.iter().map(|queue| queue.bytes).sum()
    }
}

/// Follows which blocks of a map change, until it is dropped.
///
/// A change is told before its revision is published. So whoever holds a view of the whole map and then asks
/// ([`BlockFollower::take`]) has heard of all that led to it.
#[derive(Debug)]
pub struct BlockFollower {
    follower: u64,
    followers: Arc<Mutex<Queues>>,
}

impl BlockFollower {
    /// True where nothing changed since the last time it was asked.
    pub fn is_up_to_date(&self) -> bool {
        self.with(|queue| queue.touched.is_empty() && !queue.everything).unwrap_or(true)
    }

    /// What changed since it was asked last: each block once.
    pub fn take(&self) -> TouchedBlocks {
        let (changes, everything) = self.with(Queue::take).unwrap_or_default();
        let mut touched = TouchedBlocks { tiers: Vec::new(), everything };
        changes.iter().for_each(|change| touched.extend(change));
        touched.merged()
    }

    /// Says how many bytes of memory the follower holds, which the map counts among its own.
    pub fn set_bytes(&self, bytes: usize) {
        self.with(|queue| queue.bytes = bytes);
    }

    fn with<T>(&self, f: impl FnOnce(&mut Queue) -> T) -> Option<T> {
        let mut queues = self.followers.lock();
        queues.queues.iter_mut().find(|queue| queue.follower == self.follower).map(f)
    }
}

impl Drop for BlockFollower {
    fn drop(&mut self) {
        self.followers.lock().queues.retain(|queue| queue.follower != self.follower);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::multi_resolution_map::MultiResolutionMap;
    use crate::map::settings::MapSettings;
    use crate::voxel::VoxelSet;

    fn voxels(indices: &[[i32; 3]]) -> VoxelSet {
        indices.iter().filter_map(|index| VoxelKey::new(*index)).collect()
    }

    fn exchange(map: &MultiResolutionMap, removed: &[[i32; 3]], added: &[[i32; 3]]) {
        map.committer().exchange(&voxels(removed), &voxels(added));
    }

    fn count(touched: &TouchedBlocks) -> Vec<usize> {
        touched.tiers.iter().map(|tier| tier.iter().map(|(_, changed)| changed.count(0)).sum()).collect()
    }

    #[test]
    fn a_follower_hears_of_each_voxel_that_is_not_as_it_was() {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 5)).unwrap();
        exchange(&map, &[], &[[9, 9, 9]]);
        let follower = map.follow_blocks();
        assert!(follower.is_up_to_date());
        exchange(&map, &[], &[[9, 9, 9], [-1, 2, 3], [-1, 2, 4]]);
        assert!(!follower.is_up_to_date());
        exchange(&map, &[[-1, 2, 4]], &[[-1, 2, 5]]);
        let touched = follower.take();
        assert_eq!(count(&touched), [2, 1]);
        assert!(!touched.everything && follower.is_up_to_date());
        exchange(&map, &[[-1, 2, 3]], &[]);
        exchange(&map, &[], &[[-1, 2, 3]]);
        assert!(!follower.is_up_to_date());
        assert!(follower.take().is_empty());
    }

    #[test]
    fn whoever_does_not_ask_is_told_that_everything_changed() {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
        let follower = map.follow_blocks();
        for x in 0..2 {
            let blocks = (0..QUEUE_BLOCKS_MAX as i32 / 2 + 100).map(|i| [i % 512 * 8 + x, i / 512 * 8, 0]);
            exchange(&map, &[], &blocks.collect::<Vec<_>>());
            assert_eq!(follower.followers.lock().queues[0].everything, x == 1);
        }
        assert!(!map.followers.want_blocks());
        exchange(&map, &[], &[[0, 0, 7]]);
        assert!(follower.take().everything && map.followers.want_blocks());
        exchange(&map, &[], &[[0, 0, 9]]);
        assert_eq!(count(&follower.take())[0], 1);
    }

    #[test]
    fn a_shard_that_loses_everything_may_have_changed_anywhere() {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
        exchange(&map, &[], &[[1, 1, 1]]);
        let follower = map.follow_blocks();
        exchange(&map, &[[1, 1, 1]], &[]);
        assert!(follower.take().everything);
    }

    #[test]
    fn the_map_counts_what_its_followers_hold_until_they_go() {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
        let (before, follower) = (map.memory_bytes(), map.follow_blocks());
        follower.set_bytes(1000);
        assert_eq!((map.memory_bytes(), map.describe(0, 0).follower_bytes), (before + 1000, 1000));
        drop(follower);
        assert_eq!(map.memory_bytes(), before);
        assert!(!map.followers.want_blocks());
    }
}
