//! Many blocks, or keys, at once: their cache misses are under way together.

use super::block_change::BlockChange;
use crate::bloom::{CountingBloomFilter, Probe};
use crate::util::prefetch;
use crate::voxel::{BlockInCluster, BlockMask, ClusterTable, VoxelKey};

/// Cache misses that are under way at once.
const AT_ONCE: usize = 32;

/// Calls `f(change, voxels there)` for each block that changes: what leads to the next of them is fetched in three
/// steps.
pub(super) fn find_each(
    table: &ClusterTable,
    changes: &[BlockChange<'_>],
    mut f: impl FnMut(&BlockChange<'_>, &BlockMask),
) {
    for changes in changes.chunks(AT_ONCE) {
        let mut places = [(VoxelKey::default(), BlockInCluster::default()); AT_ONCE];
        for (place, change) in places.iter_mut().zip(changes) {
            *place = BlockInCluster::of(change.block);
            prefetch(table.home(place.0));
        }
        let (mut clusters, mut last) = ([None; AT_ONCE], None);
        for (i, &(key, _)) in places[..changes.len()].iter().enumerate() {
            // Blocks come row by row: the last cluster is met again more often than not.
            if last != Some(key) {
                last = Some(key);
                clusters[i] = table.cluster(key);
                clusters[i].into_iter().for_each(|cluster| prefetch(cluster));
            } else {
                clusters[i] = clusters[i - 1];
            }
        }
        let mut found = [&BlockMask::EMPTY; AT_ONCE];
        for ((found, cluster), (_, place)) in found.iter_mut().zip(clusters).zip(places) {
            *found = cluster.map_or(&BlockMask::EMPTY, |cluster| cluster.get(place));
            prefetch(*found);
        }
        changes.iter().zip(found).for_each(|(change, before)| f(change, before));
    }
}

/// Counts keys in or out, and says what is to become of the plane. That is fetched too, so that it is near when
/// readers wait for it.
pub(super) fn count_each(
    filter: &CountingBloomFilter,
    keys: &[u64],
    count: impl Fn(&CountingBloomFilter, Probe) -> Probe,
) -> Vec<Probe> {
    let mut probes: Vec<_> = keys.iter().map(|&key| filter.probe(key)).collect();
    for probes in probes.chunks_mut(AT_ONCE) {
        for &probe in &*probes {
            prefetch(filter.counters_at(probe));
            prefetch(filter.plane_at(probe));
        }
        probes.iter_mut().for_each(|probe| *probe = count(filter, *probe));
    }
    probes
}

/// Sets or clears what was counted.
pub(super) fn write_plane_bits(
    filter: &mut CountingBloomFilter,
    probes: &[Probe],
    show: impl Fn(&mut CountingBloomFilter, Probe),
) {
    for probes in probes.chunks(AT_ONCE) {
        probes.iter().for_each(|&probe| prefetch(filter.plane_at(probe)));
        probes.iter().for_each(|&probe| show(filter, probe));
    }
}
