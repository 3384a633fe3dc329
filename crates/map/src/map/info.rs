//! What a map says of itself: sizes, and false positive rates as expected and as measured.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::content_hash::ContentVersion;
use super::multi_resolution_map::MultiResolutionMap;
use super::shards::Shard;
use super::view::MapView;
use crate::bloom::CountingBloomFilter;
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Size and filter of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelInfo {
    /// 0 is the finest.
    pub level: u32,
    /// Side of its voxels, meters.
    pub resolution_m: f64,
    /// Occupied voxels.
    pub voxels: usize,
    /// Its filter; none in a map without filters.
    pub filter: Option<FilterInfo>,
}

/// Size and false positive rates of a level's filter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FilterInfo {
    /// Bytes of the filter's bit plane, which look-ups read.
    pub plane_bytes: usize,
    /// Bytes of the filter's counters, which only changes read.
    pub counter_bytes: usize,
    /// False positive rate by the closed form of the filter's layout: the mean over shards, weighted by voxels.
    pub expected_rate: f64,
    /// The false-positive rate by eq. (1) of the paper.
    pub ideal_false_positive_rate: f64,
    /// The share of absent neighbors of occupied voxels that the filter lets through; none of an empty level.
    pub measured_rate: Option<f64>,
}

/// What a map holds at one revision.
#[derive(Debug, Clone, PartialEq)]
pub struct MapDescription {
    /// Committed changes, and the hash of the finest voxels.
    pub version: ContentVersion,
    /// Every level, finest first.
    pub levels: Vec<LevelInfo>,
    /// Bytes of memory of the exact sets of all levels.
    pub set_bytes: usize,
    /// Bytes of memory of the points' moments.
    pub moment_bytes: usize,
    /// Bytes of memory of what is derived of the voxels beside the map, as planners do.
    pub follower_bytes: usize,
    /// Bytes of memory of the trajectory, with what is known of scans whose poses are not kept.
    pub trajectory_bytes: usize,
    /// How many scans left a viewpoint, see [`crate::visibility`].
    pub viewpoints: usize,
    /// Bytes of memory of the viewpoints.
    pub viewpoint_bytes: usize,
}

impl MultiResolutionMap {
    /// Describes the map, at one revision but for the bytes of moments and of what lies beside the voxels. Waits for no
    /// [long read](MultiResolutionMap::long_read), and for no change that waits for one: it takes some milliseconds.
    ///
    /// False positives are measured on `samples` absent neighbors of occupied voxels a level, drawn from `seed`.
    pub fn describe(&self, samples: usize, seed: u64) -> MapDescription {
        self.described_until(samples, seed, StopSignal::NEVER)
    }

    /// [`MultiResolutionMap::describe`], with a look at the stop signal before each shard of each level; none once
    /// stopped.
    pub fn describe_until(&self, samples: usize, seed: u64, stop: StopSignal<'_>) -> Option<MapDescription> {
        Some(self.described_until(samples, seed, stop)).filter(|_| !stop.is_stopped())
    }

    /// The description, which is of no use once stopped.
    fn described_until(&self, samples: usize, seed: u64, stop: StopSignal<'_>) -> MapDescription {
        let (moments, view) = (self.moments(), self.view());
        let describe_level = |level| self.describe_level(&view, level, samples, seed, stop);
        let levels = (0..self.settings.levels).map(describe_level);
        let viewpoints = self.viewpoints();
        MapDescription {
            version: view.version(),
            levels: levels.collect(),
            set_bytes: view.shards().map(Shard::set_bytes).sum(),
            moment_bytes: moments.map_or(0, |moments| moments.bytes()),
            follower_bytes: self.followers.bytes(),
            trajectory_bytes: self.trajectory().memory_bytes(),
            viewpoints: viewpoints.len(),
            viewpoint_bytes: viewpoints.memory_bytes(),
        }
    }

    /// Bytes of memory of the exact sets of all levels, the points' moments and the trajectory, and of what is derived
    /// of the voxels beside the map.
    pub fn memory_bytes(&self) -> usize {
        let (moments, view) = (self.moments(), self.view());
        view.shards().map(Shard::set_bytes).sum::<usize>()
            + moments.map_or(0, |moments| moments.bytes())
            + self.trajectory().memory_bytes()
            + self.viewpoints().memory_bytes()
            + self.followers.bytes()
    }

    /// Bytes of memory of the exact sets of all levels.
    pub fn set_bytes(&self) -> usize {
        self.view().shards().map(Shard::set_bytes).sum()
    }

    /// Bytes of memory of the bit planes of all levels' filters.
    pub fn plane_bytes(&self) -> usize {
        let view = self.view();
        let filters = (0..self.settings.levels).flat_map(|level| filters(&view, level));
        filters.map(|filter| filter.bytes().0).sum()
    }

    fn describe_level(
        &self,
        view: &MapView<'_>,
        level: u32,
        samples: usize,
        seed: u64,
        stop: StopSignal<'_>,
    ) -> LevelInfo {
        let voxels = view.lists(level).map(|list| list.len()).sum();
        let has_filter = self.settings.filter.is_some();
        let filter = has_filter.then(|| FilterInfo {
            measured_rate: measured_rate(view, level, samples, seed, stop),
            ..FilterInfo::of(filters(view, level), voxels)
        });
        LevelInfo { level, resolution_m: self.lattice.resolution_m(level), voxels, filter }
    }
}

impl FilterInfo {
    /// What the filters of a level with so many voxels say of themselves.
    fn of<'a>(filters: impl Iterator<Item = &'a CountingBloomFilter>, voxels: usize) -> Self {
        let mut info = Self::default();
        let of_all = voxels.max(1) as f64;
        for filter in filters {
            let ((plane, counters), share) = (filter.bytes(), filter.len() as f64 / of_all);
            info.plane_bytes += plane;
            info.counter_bytes += counters;
            info.expected_rate += filter.expected_rate() * share;
            info.ideal_false_positive_rate += filter.ideal_false_positive_rate() * share;
        }
        info
    }

    /// Bytes of the plane and the counters.
    pub fn bytes(&self) -> usize {
        self.plane_bytes + self.counter_bytes
    }
}

/// The filters of a level, shard by shard.
fn filters<'v>(view: &'v MapView<'_>, level: u32) -> impl Iterator<Item = &'v CountingBloomFilter> {
    view.lists(level).filter_map(|list| list.filter())
}

/// The share of about `samples` absent neighbors of occupied voxels that the filter takes for occupied.
///
/// Queries near surfaces are what planners and alignments ask, so this is the rate they meet. Occupied voxels are
/// drawn from every n-th block of each shard, so that the cost does not grow with the map.
fn measured_rate(
    view: &MapView<'_>,
    level: u32,
    samples: usize,
    seed: u64,
    stop: StopSignal<'_>,
) -> Option<f64> {
    let total: usize = view.lists(level).map(|list| list.len()).sum();
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ u64::from(level));
    let (mut absent, mut let_through) = (0usize, 0usize);
    for list in stop.paced(view.lists(level).filter(|list| !list.is_empty()), 1) {
        let wish = (samples * list.len()).div_ceil(total);
        for voxel in list.sample(wish, &mut random) {
            let Some(neighbor) = random_neighbor(voxel, &mut random) else {
                continue;
            };
            if !view.contains(neighbor, level) {
                absent += 1;
                let_through += usize::from(view.may_contain(neighbor, level));
            }
        }
    }
    (absent > 0).then(|| let_through as f64 / absent as f64)
}

/// One of the 26 voxels around `voxel`.
fn random_neighbor(voxel: VoxelKey, random: &mut ChaCha8Rng) -> Option<VoxelKey> {
    let step = random.random_range(0..26);
    let step = if step < 13 { step } else { step + 1 };
    let [x, y, z] = voxel.index();
    VoxelKey::new([x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1])
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::Duration;

    use crate::map::{MapContents, MapSettings, MultiResolutionMap};
    use crate::voxel::{VoxelKey, VoxelSet};

    #[test]
    fn a_description_waits_for_no_change_that_waits_for_a_long_read() {
        let voxel = VoxelKey::new([1, 2, 3]).unwrap();
        let contents = MapContents::at(7, [voxel].into_iter().collect());
        let map = MultiResolutionMap::restore(MapSettings::new(0.1, 2), contents).unwrap();
        let (long_read, gone) = (map.long_read(), map.view().voxels());
        std::thread::scope(|threads| {
            threads.spawn(|| map.committer().exchange(&gone, &VoxelSet::default()));
            // A change that waits lets no further long read begin.
            while map.try_long_read().is_some() {
                std::thread::yield_now();
            }
            let (told, described) = channel();
            threads.spawn(|| {
                let described = map.describe(16, 1);
                told.send((described.version.revision, map.memory_bytes() > 0)).unwrap();
                drop(told);
            });
            let described = described.recv_timeout(Duration::from_secs(20));
            drop(long_read);
            assert_eq!(described, Ok((7, true)));
        });
        assert_eq!(map.describe(16, 1).version.revision, 8);
    }
}
