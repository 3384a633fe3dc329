//! What becomes of a level, and of its filter, when keys go and come.

use super::bulk::{count_each, write_plane_bits};
use super::level_moves::LevelMoves;
use crate::bloom::{CountingBloomFilter, Probe};
use crate::map::shards::{CapacitySchedule, Shard, ShardLevel};
use crate::util::StopSignal;

/// Keys that a filter is built of between two looks at the stop signal: some milliseconds.
const KEYS_PER_STOP_CHECK: usize = 64 << 10;

/// Keys a level whose bits are cleared in place, while readers wait. Beyond that a copy of the plane is cleared
/// beforehand, which takes longer in all and keeps nobody waiting.
const CLEARED_IN_PLACE: usize = 2048;

/// What becomes of a level. The counters of its filter count the change already.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct LevelUpdate {
    /// Occupied voxels afterwards.
    voxels: usize,
    /// None in a map without filters.
    filter: Option<FilterUpdate>,
}

impl LevelUpdate {
    /// Finds out what becomes of a level of `shard` where `moves` go and come, and counts them in its filter.
    pub(super) fn plan(shard: &Shard, moves: LevelMoves, stop: StopSignal<'_>) -> Self {
        let level = &shard.levels[moves.level()];
        let voxels = moves.voxels_after(level.voxels);
        let filter = level.filter.as_ref().map(|filter| FilterUpdate::plan(shard, filter, moves, stop));
        Self { voxels, filter }
    }

    /// Does it, while readers wait.
    pub(super) fn apply(self, level: &mut ShardLevel) {
        level.voxels = self.voxels;
        if let (Some(filter), Some(update)) = (&mut level.filter, self.filter) {
            update.apply(filter);
        }
    }
}

/// What becomes of a filter.
#[derive(Debug)]
enum FilterUpdate {
    /// The bits of keys that go are cleared, and then those of keys that come are set.
    Bits { cleared: Vec<Probe>, set: Vec<Probe> },
    /// The plane gives way to one without the bits of so many keys; then bits are set.
    Plane { plane: Vec<u64>, keys_lost: usize, set: Vec<Probe> },
    /// The filter gives way to a larger one, which has all that the level has then.
    Grown(CountingBloomFilter),
}

impl FilterUpdate {
    /// Finds out what becomes of a filter of `shard` when the keys of `moves` go and come, and counts them. A larger
    /// filter also forgets saturated counters.
    fn plan(shard: &Shard, filter: &CountingBloomFilter, moves: LevelMoves, stop: StopSignal<'_>) -> Self {
        let (level, (lost, gained)) = (moves.level(), moves.into_keys());
        let need = filter.len() + gained.len();
        if need > filter.capacity() {
            let capacity = CapacitySchedule::of(shard.number, level).for_items(need);
            let mut larger = CountingBloomFilter::with_capacity(capacity, filter.settings());
            stop.pieces(&gained, KEYS_PER_STOP_CHECK).for_each(|keys| larger.insert_each(keys));
            shard.level(level as u32).for_some_keys(|keys| larger.insert_each(keys));
            lost.iter().for_each(|&key| larger.remove(key));
            return Self::Grown(larger);
        }
        // Those that go first: a bit that both share stays set.
        if lost.len() <= CLEARED_IN_PLACE {
            let cleared = count_each(filter, &lost, CountingBloomFilter::count_out);
            return Self::Bits { cleared, set: count_each(filter, &gained, CountingBloomFilter::count_in) };
        }
        let mut plane = filter.plane().to_vec();
        for keys in stop.pieces(&lost, CLEARED_IN_PLACE) {
            for cleared in count_each(filter, keys, CountingBloomFilter::count_out) {
                plane[cleared.word] &= !cleared.mask;
            }
        }
        let set = count_each(filter, &gained, CountingBloomFilter::count_in);
        Self::Plane { plane, keys_lost: lost.len(), set }
    }

    /// Does it, while readers wait.
    fn apply(self, filter: &mut CountingBloomFilter) {
        let set = match self {
            Self::Grown(larger) => {
                *filter = larger;
                return;
            }
            Self::Bits { cleared, set } => {
                write_plane_bits(filter, &cleared, CountingBloomFilter::clear_bits);
                set
            }
            Self::Plane { plane, keys_lost, set } => {
                filter.set_plane(plane, keys_lost);
                set
            }
        };
        write_plane_bits(filter, &set, CountingBloomFilter::set_bits);
    }
}
