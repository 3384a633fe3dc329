//! What becomes of the clusters that a change touches.

use hashbrown::HashMap;

use super::block::BlockMask;
use super::cluster::{BlockInCluster, Cluster};
use super::cluster_table::ClusterTable;
use super::key::VoxelKey;
use super::set::BLOCKS_PER_STOP_CHECK;
use crate::util::StopSignal;

/// Clusters as a change leaves them, made beside those that they are to replace: so readers go on meanwhile, and are
/// kept waiting for no more than an exchange of pointers.
#[derive(Debug)]
#[must_use = "nothing has changed yet"]
pub(crate) struct ClusterUpdate(Vec<(VoxelKey, Cluster)>);

impl ClusterUpdate {
    /// The clusters of `table` that change once each of `blocks`, none of which comes twice, has got these voxels: none
    /// takes the block out. Once stopped, what comes of it is not to be applied.
    pub(crate) fn plan(table: &ClusterTable, blocks: &[(VoxelKey, BlockMask)], stop: StopSignal<'_>) -> Self {
        let mut touched = Touched::default();
        let mut numbers = Vec::with_capacity(blocks.len());
        for (block, mask) in stop.pieces(blocks, BLOCKS_PER_STOP_CHECK).flatten() {
            let (key, place) = BlockInCluster::of(*block);
            let number = touched.number(table, key);
            let present = &mut touched.clusters[number].present;
            *present = if mask.is_empty() { *present & !place.bit() } else { *present | place.bit() };
            numbers.push(number);
        }
        let mut clusters = Vec::with_capacity(touched.clusters.len());
        for touched in stop.pieces(&touched.clusters, BLOCKS_PER_STOP_CHECK) {
            clusters.extend(touched.iter().map(TouchedCluster::renewed));
        }
        if stop.is_stopped() {
            return Self(clusters);
        }
        let new = stop.paced(blocks.iter().zip(numbers), BLOCKS_PER_STOP_CHECK);
        for ((block, mask), number) in new.filter(|((_, mask), _)| !mask.is_empty()) {
            clusters[number].1.set(BlockInCluster::of(*block).1, *mask);
        }
        Self(clusters)
    }

    /// Exchanges the clusters.
    pub(crate) fn apply(self, table: &mut ClusterTable) {
        self.0.into_iter().for_each(|(key, cluster)| table.set_cluster(key, cluster));
    }
}

/// The clusters in which blocks change, in the order in which they were met.
#[derive(Default)]
struct Touched<'a> {
    clusters: Vec<TouchedCluster<'a>>,
    numbers: HashMap<VoxelKey, usize>,
    last: Option<(VoxelKey, usize)>,
}

struct TouchedCluster<'a> {
    key: VoxelKey,
    before: Option<&'a Cluster>,
    /// The blocks that are there afterwards.
    present: u64,
}

impl<'a> Touched<'a> {
    /// The number of a cluster of `table`, whether it is there or not.
    fn number(&mut self, table: &'a ClusterTable, key: VoxelKey) -> usize {
        // Blocks come row by row: the last cluster is met again more often than not.
        if let Some((_, number)) = self.last.filter(|(last, _)| *last == key) {
            return number;
        }
        let number = *self.numbers.entry(key).or_insert_with(|| {
            let before = table.cluster(key);
            self.clusters.push(TouchedCluster { key, before, present: before.map_or(0, |c| c.present) });
            self.clusters.len() - 1
        });
        self.last = Some((key, number));
        number
    }
}

impl TouchedCluster<'_> {
    fn renewed(&self) -> (VoxelKey, Cluster) {
        let nothing = Cluster::default();
        (self.key, self.before.unwrap_or(&nothing).with_blocks(self.present))
    }
}
