//! The clusters that were met last: what is asked next lies near what was asked before.

use crate::map::TierView;
use crate::voxel::{Cluster, VoxelKey};

/// How many are kept: a power of two along each axis, as many as a large room has.
const RECENT: [u32; 3] = [3, 3, 2];
const COUNT: usize = 1 << (RECENT[0] + RECENT[1] + RECENT[2]);

/// The clusters of a view by their pieces (see [`TierView::piece_levels`]), those that were met last near at hand.
pub(super) struct RecentClusters<'a> {
    view: TierView<'a>,
    piece_levels: u32,
    /// Stands for clusters that are not there.
    nothing: &'a Cluster,
    clusters: Box<[(VoxelKey, &'a Cluster); COUNT]>,
}

impl<'a> RecentClusters<'a> {
    /// None of the clusters of `view` yet; `nothing` is a cluster without a block.
    pub(super) fn new(view: TierView<'a>, nothing: &'a Cluster) -> Self {
        // Only the piece at the origin has this key, and its place is the first.
        let mut clusters = Box::new([(VoxelKey::default(), nothing); COUNT]);
        clusters[0].1 = view.cluster_around([0; 3]).unwrap_or(nothing);
        Self { piece_levels: view.piece_levels(), view, nothing, clusters }
    }

    /// The view.
    pub(super) fn view(&self) -> &TierView<'a> {
        &self.view
    }

    /// The cluster that holds everything in the piece around `cell`; one without a block where there is none.
    #[inline(always)]
    pub(super) fn around(&mut self, cell: [i32; 3]) -> &'a Cluster {
        let piece = cell.map(|i| i >> self.piece_levels);
        let key = VoxelKey::pack(piece);
        let [x, y, z]: [usize; 3] =
            std::array::from_fn(|axis| (piece[axis] & ((1 << RECENT[axis]) - 1)) as usize);
        let place = x | y << RECENT[0] | z << (RECENT[0] + RECENT[1]);
        if self.clusters[place].0 != key {
            self.remember(place, key, cell);
        }
        self.clusters[place].1
    }

    #[inline(never)]
    fn remember(&mut self, place: usize, key: VoxelKey, cell: [i32; 3]) {
        self.clusters[place] = (key, self.view.cluster_around(cell).unwrap_or(self.nothing));
    }
}
