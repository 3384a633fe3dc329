//! The search around one point: clusters near first, then blocks near first, as far as they can hold something nearer.

use super::block::nearest_in_block;
use super::{MeasuredTo, Nearest};
use crate::geometry::Point;
use crate::map::TierView;
use crate::util::bits::for_each_bit;
use crate::voxel::{BLOCK_SIDE, BlockInCluster, CLUSTER_SIDE, Cluster, VoxelKey};

/// Blocks along a cluster's side.
const BLOCKS: usize = (CLUSTER_SIDE / BLOCK_SIDE) as usize;

/// A search within one radius. All lengths are in cells, see [`TierView`].
pub(super) struct Search<'a> {
    view: TierView<'a>,
    radius: f64,
    /// How far inside its cube's faces a voxel is measured to: 0, or half its side.
    inset: f64,
}

/// The nearest voxel so far, and what the next has to be nearer than.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct Best {
    /// Square of its distance.
    pub(super) squared: f64,
    /// Its packed key, the smallest of those equally far; none has the largest number.
    pub(super) key: u64,
}

/// Squared distance along one axis from `at` to the interval from `low` to `high`.
#[inline(always)]
pub(super) fn squared_gap(at: f64, low: f64, high: f64) -> f64 {
    let gap = gap(at, low, high);
    gap * gap
}

/// How far `at` lies beyond the interval from `low` to `high`: negative below it.
#[inline(always)]
fn gap(at: f64, low: f64, high: f64) -> f64 {
    if at < low {
        at - low
    } else if at > high {
        at - high
    } else {
        0.0
    }
}

/// A point as a search sees it.
pub(super) struct Seeker {
    /// Where it is, cells.
    pub(super) at: [f64; 3],
    pub(super) inset: f64,
    pub(super) up: u32,
    pub(super) best: Best,
}

impl Seeker {
    /// Squared distances, axis by axis, to each of `N` cubes in a row: of `side` cells, the first at `first`.
    #[inline(always)]
    pub(super) fn squared_gaps<const N: usize>(&self, first: [i32; 3], side: i32) -> [[f64; N]; 3] {
        std::array::from_fn(|axis| {
            std::array::from_fn(|i| {
                let low = first[axis] + i as i32 * side;
                let (low, high) = (f64::from(low) + self.inset, f64::from(low + side) - self.inset);
                squared_gap(self.at[axis], low, high)
            })
        })
    }

    /// True where something as far as that can be nearer than the best, or as near.
    #[inline(always)]
    pub(super) fn may_be_nearest(&self, squared: f64) -> bool {
        squared <= self.best.squared
    }
}

impl<'a> Search<'a> {
    /// A search of the voxels of `view` within `radius_m`.
    pub(super) fn new(view: TierView<'a>, radius_m: f64, to: MeasuredTo) -> Self {
        let side = f64::from(1 << view.up());
        let inset = match to {
            MeasuredTo::Cubes => 0.0,
            MeasuredTo::Centers => side / 2.0,
        };
        Self { radius: radius_m / view.cell_m(), inset, view }
    }

    /// The nearest voxel within the radius of `point`.
    pub(super) fn nearest(&self, point: Point) -> Option<Nearest> {
        if !point.is_finite() {
            return None;
        }
        let at = point.xyz().map(|c| f64::from(c) / self.view.cell_m());
        let best = Best { squared: self.radius * self.radius, key: u64::MAX };
        let mut seeker = Seeker { at, inset: self.inset, up: self.view.up(), best };
        self.search_clusters(&mut seeker);
        self.told(&seeker)
    }

    /// What was found, in meters.
    fn told(&self, seeker: &Seeker) -> Option<Nearest> {
        let voxel = VoxelKey::from_bits(seeker.best.key)?;
        let (index, up) = (voxel.index(), seeker.up);
        let distance = seeker.best.squared.sqrt();
        let away = std::array::from_fn(|axis| {
            let low = f64::from(index[axis] << up) + self.inset;
            let high = f64::from((index[axis] + 1) << up) - self.inset;
            gap(seeker.at[axis], low, high) / distance
        });
        let away = if distance > 0.0 { away } else { [0.0; 3] };
        Some(Nearest { distance_m: distance * self.view.cell_m(), voxel, away })
    }

    /// Searches clusters shell by shell around that of the point.
    fn search_clusters(&self, seeker: &mut Seeker) {
        let at = |offset: f64| self.view.cluster_index(seeker.at.map(|c| c + offset));
        let (low, middle, high) = (at(-self.radius), at(0.0), at(self.radius));
        let farthest = |axis: usize| (high[axis] - middle[axis]).max(middle[axis] - low[axis]);
        for shell in 0..=farthest(0).max(farthest(1)).max(farthest(2)) {
            if !seeker.may_be_nearest(squared_to_shell(seeker, middle, shell)) {
                return;
            }
            for_each_in_shell(middle, shell, (low, high), |cluster| self.search_cluster(seeker, cluster));
        }
    }

    fn search_cluster(&self, seeker: &mut Seeker, index: [i32; 3]) {
        let first = index.map(|i| i * CLUSTER_SIDE);
        let [[x], [y], [z]] = seeker.squared_gaps::<1>(first, CLUSTER_SIDE);
        if !seeker.may_be_nearest(x + y + z) {
            return;
        }
        for cluster in self.view.clusters(VoxelKey::pack(index)) {
            search_blocks(seeker, cluster, first);
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
        (seeker.at[axis] - low).min(high - seeker.at[axis]).max(0.0) + seeker.inset
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

/// The places of a cluster by their distance along the axis on which that is largest, from each place: bit sets.
static RINGS: [[u64; BLOCKS]; BLOCKS * BLOCKS * BLOCKS] = {
    let mut rings = [[0; BLOCKS]; BLOCKS * BLOCKS * BLOCKS];
    let mut pair = 0;
    while pair < rings.len() * rings.len() {
        let (from, to) = (pair / rings.len(), pair % rings.len());
        let (mut ring, mut shift) = (0, 0);
        while shift < 6 {
            let apart = (from >> shift & 3).abs_diff(to >> shift & 3);
            ring = if apart > ring { apart } else { ring };
            shift += 2;
        }
        rings[from][ring] |= 1 << to;
        pair += 1;
    }
    rings
};

/// Searches the blocks of a cluster whose first cell is `first`, ring by ring around that nearest to the point.
fn search_blocks(seeker: &mut Seeker, cluster: &Cluster, first: [i32; 3]) {
    let gaps = seeker.squared_gaps::<BLOCKS>(first, BLOCK_SIDE);
    let nearest: [i32; 3] = std::array::from_fn(|axis| {
        let blocks = (seeker.at[axis] - f64::from(first[axis])) / f64::from(BLOCK_SIDE);
        first[axis] + blocks.clamp(0.0, (BLOCKS - 1) as f64) as i32 * BLOCK_SIDE
    });
    for ring in RINGS[BlockInCluster::of_voxel(nearest).number()] {
        for_each_bit(cluster.present & ring, |number| {
            let place = BlockInCluster::from_number(number);
            let index = place.index();
            if seeker.may_be_nearest(gaps[0][index[0]] + gaps[1][index[1]] + gaps[2][index[2]]) {
                let first = std::array::from_fn(|axis| first[axis] + index[axis] as i32 * BLOCK_SIDE);
                nearest_in_block(seeker, cluster.get(place), first);
            }
        });
    }
}
