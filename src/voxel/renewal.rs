//! What becomes of the clusters that a change touches.

use hashbrown::HashMap;

use super::cluster::{Cluster, Place};
use super::{BlockMask, BlockTable, VoxelKey};

/// Clusters as a change leaves them, made beside those that they are to replace: so readers go on meanwhile, and are
/// kept waiting for no more than an exchange of pointers.
#[derive(Debug)]
#[must_use = "nothing has changed yet"]
pub(crate) struct Renewal(Vec<(VoxelKey, Cluster)>);

impl Renewal {
    /// Of the clusters of `table`, once each of `blocks`, none of which comes twice, has got these voxels: none takes
    /// the block out.
    pub(crate) fn plan(table: &BlockTable, blocks: &[(VoxelKey, BlockMask)]) -> Self {
        let mut renewed = Numbered::default();
        let mut numbers = Vec::with_capacity(blocks.len());
        for (block, mask) in blocks {
            let (cluster, place) = Place::of(*block);
            let number = renewed.number(table, cluster);
            let present = &mut renewed.present[number].1;
            *present = if mask.is_empty() { *present & !place.bit() } else { *present | place.bit() };
            numbers.push(number);
        }
        let nothing = Cluster::default();
        let with_blocks =
            |&(key, present): &_| (key, table.cluster(key).unwrap_or(&nothing).with_blocks(present));
        let mut clusters: Vec<_> = renewed.present.iter().map(with_blocks).collect();
        for ((block, mask), number) in blocks.iter().zip(numbers).filter(|((_, mask), _)| !mask.is_empty()) {
            clusters[number].1.set(Place::of(*block).1, *mask);
        }
        Self(clusters)
    }

    /// Exchanges the clusters.
    pub(crate) fn apply(self, table: &mut BlockTable) {
        self.0.into_iter().for_each(|(key, cluster)| table.set_cluster(key, cluster));
    }
}

/// The clusters that are renewed and the blocks that will be in them, in the order in which they were met.
#[derive(Default)]
struct Numbered {
    present: Vec<(VoxelKey, u64)>,
    numbers: HashMap<VoxelKey, usize>,
}

impl Numbered {
    fn number(&mut self, table: &BlockTable, cluster: VoxelKey) -> usize {
        let Self { present, numbers } = self;
        // Blocks come row by row: the last cluster is met again more often than not.
        match present.last() {
            Some(&(last, _)) if last == cluster => present.len() - 1,
            _ => *numbers.entry(cluster).or_insert_with(|| {
                present.push((cluster, table.cluster(cluster).map_or(0, |cluster| cluster.present)));
                present.len() - 1
            }),
        }
    }
}
