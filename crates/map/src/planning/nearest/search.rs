//! The search around one point: clusters near first, then blocks near first, as far as they can hold something nearer.

use super::block::nearest_in_block;
use super::nearest_voxels::Nearest;
use super::request::MeasuredTo;
use super::seeker::Seeker;
use crate::geometry::Point;
use crate::map::TierView;
use crate::planning::recent_clusters::RecentClusters;
use crate::util::bits::for_each_bit;
use crate::voxel::{BLOCK_SIDE, BlockInCluster, CLUSTER_LEVELS, CLUSTER_SIDE, Cluster, VoxelKey};

/// Blocks along a cluster's side.
const BLOCKS: usize = 1 << CLUSTER_LEVELS;

/// A search within one radius. All lengths are in cells, see [`TierView`].
pub(super) struct Search<'a> {
    clusters: RecentClusters<'a>,
    radius: f64,
    /// How far inside its cube's faces a voxel is measured to: 0, or half its side.
    inset: f64,
}

impl<'a> Search<'a> {
    /// A search of the voxels of `view` within `radius_m`; `nothing` is a cluster without a block.
    pub(super) fn new(view: TierView<'a>, nothing: &'a Cluster, radius_m: f64, to: MeasuredTo) -> Self {
        let side = f64::from(1 << view.up());
        let inset = match to {
            MeasuredTo::Cubes => 0.0,
            MeasuredTo::Centers => side / 2.0,
        };
        Self { radius: radius_m / view.cell_m(), inset, clusters: RecentClusters::new(view, nothing) }
    }

    /// The nearest voxel within the radius of `point`.
    pub(super) fn nearest(&mut self, point: Point) -> Option<Nearest> {
        if !point.is_finite() {
            return None;
        }
        let view = self.clusters.view();
        let (cell_m, up) = (view.cell_m(), view.up());
        let at = point.xyz().map(|c| f64::from(c) / cell_m);
        let mut seeker = Seeker::new(at, self.radius, self.inset, up);
        self.search_clusters(&mut seeker);
        let (voxel, distance, away) = seeker.found()?;
        Some(Nearest { distance_m: distance * cell_m, voxel, away })
    }

    /// Searches clusters shell by shell around that of the point.
    fn search_clusters(&mut self, seeker: &mut Seeker) {
        let at = |offset: f64| self.clusters.view().cluster_index(seeker.at.map(|c| c + offset));
        let (low, middle, high) = (at(-self.radius), at(0.0), at(self.radius));
        let farthest = |axis: usize| (high[axis] - middle[axis]).max(middle[axis] - low[axis]);
        for shell in 0..=farthest(0).max(farthest(1)).max(farthest(2)) {
            if !seeker.may_be_nearest(squared_to_shell(seeker, middle, shell)) {
                return;
            }
            for_each_in_shell(middle, shell, (low, high), |cluster| self.search_cluster(seeker, cluster));
        }
    }

    #[inline]
    fn search_cluster(&mut self, seeker: &mut Seeker, index: [i32; 3]) {
        let first = index.map(|i| i * CLUSTER_SIDE);
        let [[x], [y], [z]] = seeker.squared_gaps::<1>(first, CLUSTER_SIDE);
        if !seeker.may_be_nearest(x + y + z) {
            return;
        }
        let view = self.clusters.view();
        if view.has_whole_clusters() {
            search_blocks(seeker, self.clusters.around(first), first);
        } else {
            view.clusters(VoxelKey::pack(index)).for_each(|cluster| search_blocks(seeker, cluster, first));
        }
    }
}

/// A lower bound of the squared distance to clusters of a shell around `middle`, and of those beyond.
fn squared_to_shell(seeker: &Seeker, middle: [i32; 3], shell: i32) -> f64 {
    if shell == 0 {
        return 0.0;
    }
    let to_face = |axis: usize| {
        let low = f64::from((middle[axis] - shell + 1) * CLUSTER_SIDE);
        let high = f64::from((middle[axis] + shell) * CLUSTER_SIDE);
        // A point beyond where indices end is outside of the cluster in the middle.
        (seeker.at[axis] - low).min(high - seeker.at[axis]).max(0.0)
    };
    let nearest = to_face(0).min(to_face(1)).min(to_face(2));
    nearest * nearest
}

/// Calls `f` with each index of the shell, `shell` away from `middle` along an axis and no further along any, that lies
/// between `low` and `high`.
fn for_each_in_shell(
    middle: [i32; 3],
    shell: i32,
    (low, high): ([i32; 3], [i32; 3]),
    mut f: impl FnMut([i32; 3]),
) {
    let span = |axis: usize| low[axis].max(middle[axis] - shell)..=high[axis].min(middle[axis] + shell);
    for z in span(2) {
        for y in span(1) {
            let is_face = (z - middle[2]).abs() == shell || (y - middle[1]).abs() == shell;
            if is_face {
                span(0).for_each(|x| f([x, y, z]));
            } else {
                let ends = [middle[0] - shell, middle[0] + shell];
                ends.into_iter().filter(|x| span(0).contains(x)).for_each(|x| f([x, y, z]));
            }
        }
    }
}

/// Searches the blocks of a cluster whose first cell is `first`: the nearest, then those that may hold something
/// nearer.
#[inline]
fn search_blocks(seeker: &mut Seeker, cluster: &Cluster, first: [i32; 3]) {
    let gaps = seeker.squared_gaps::<BLOCKS>(first, BLOCK_SIDE);
    let squared = |number: u32| {
        let [x, y, z] = BlockInCluster::from_number(number).index();
        gaps[0][x] + gaps[1][y] + gaps[2][z]
    };
    let mut nearest = (f64::INFINITY, 0);
    for_each_bit(cluster.present, |number| {
        let squared = squared(number);
        if squared < nearest.0 {
            nearest = (squared, number);
        }
    });
    if !seeker.may_be_nearest(nearest.0) {
        return;
    }
    let mut search = |number: u32| {
        let place = BlockInCluster::from_number(number);
        let index = place.index();
        let first = std::array::from_fn(|axis| first[axis] + index[axis] as i32 * BLOCK_SIDE);
        nearest_in_block(seeker, cluster.get(place), first);
        seeker.best_squared()
    };
    let mut best = search(nearest.1);
    for_each_bit(cluster.present & !(1 << nearest.1), |number| {
        if squared(number) <= best {
            best = search(number);
        }
    });
}
