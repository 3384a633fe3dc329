//! How much room a shard makes as it grows.

/// Capacity grows by this factor. The rest of what a map holds beyond its voxels is empty: half the factor's excess
/// on average. The smaller it is, the more often keys are put into a larger filter: 1 / (1 - 1 / factor) times.
pub(super) const FACTOR: f64 = 1.4;
/// Capacity from the first key on.
pub(super) const FIRST: f64 = 64.0;
/// Shards grow in so many different places.
const PHASES: usize = 16;

/// The sizes that one filter goes through: FIRST * FACTOR^(n + phase).
///
/// Each shard, and each of its levels, has a phase of its own. Shards of a map fill alike; with one phase they
/// would all grow within a few scans, and so would the map's memory. With many it stays near its mean, and a
/// commit builds little.
#[derive(Debug, Clone, Copy)]
pub(in crate::map) struct CapacitySchedule {
    phase: f64,
}

impl CapacitySchedule {
    /// The schedule of one level of a shard.
    pub(in crate::map) fn of(shard: usize, level: usize) -> Self {
        // Five has no divisor in common with sixteen: levels of one shard are far apart.
        Self { phase: ((shard + 5 * level) % PHASES) as f64 / PHASES as f64 }
    }

    /// The least room for `need` items.
    pub(in crate::map) fn for_items(self, need: usize) -> usize {
        let steps = (need as f64 / FIRST).ln() / FACTOR.ln() - self.phase;
        let room = FIRST * FACTOR.powf(steps.ceil().max(0.0) + self.phase);
        (room as usize).max(need)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_enough_and_not_much_too_much() {
        for need in [1, 64, 100, 12_345, 10_000_000] {
            for shard in 0..PHASES {
                let room = CapacitySchedule::of(shard, 1).for_items(need);
                let most = (need.max(64) as f64 * FACTOR * 1.001) as usize;
                assert!((need..=most).contains(&room), "{room} for {need} of shard {shard}");
            }
        }
    }

    #[test]
    fn shards_of_one_size_have_different_room_and_the_mean_of_it() {
        let rooms: Vec<_> =
            (0..PHASES).map(|shard| CapacitySchedule::of(shard, 0).for_items(100_000)).collect();
        let different: std::collections::BTreeSet<_> = rooms.iter().collect();
        assert_eq!(different.len(), PHASES);
        let mean = rooms.iter().sum::<usize>() as f64 / (PHASES * 100_000) as f64;
        let expected = (FACTOR - 1.0) / FACTOR.ln();
        assert!((mean / expected - 1.0).abs() < 0.02, "{mean} of {expected}");
    }
}
