//! Listing the frontiers of a box, the largest first.

use super::clusters::Cluster;
use super::frontier::Frontiers;
use super::request::{FrontierError, FrontierRequest, STANDOFF_VOXELS, STANDOFF_VOXELS_MAX};
use super::view_pose::Lookout;
use super::window::{self, Window};
use crate::map::PausingView;
use crate::util::StopSignal;
use crate::voxel::{INDEX_MAX, INDEX_MIN, Lattice};

/// Most voxels of a box, whatever the request says: their places and those around are numbers of 32 bits.
const CELLS_MAX: usize = u32::MAX as usize / 32;

/// The frontiers of a box: voxels of `level` that are free and beside which, along an axis, one is unknown, in the box
/// or just outside. Voxels of a frontier touch each other, at least at corners.
///
/// Free is what [`classify_points`](crate::planning::classify_points) says of a voxel's center, so that the view needs
/// viewpoints. Each frontier is told with a place from which a line to its middle runs through free voxels alone: as
/// far away as is asked for, or else no nearer to what ends the line than to the frontier, and rather on the side where
/// nothing is unknown.
///
/// Takes half a byte a voxel of the box, and 4 a voxel of a frontier. Others go first between its parts, so that parts
/// of the box may be of later revisions than [`PausingView::version`]. Once stopped, some are missing.
///
/// # Errors
/// For corners that make no box, a box of too many voxels, and a distance out of range.
pub fn list_frontiers(
    view: &mut PausingView<'_>,
    request: &FrontierRequest,
    stop: StopSignal<'_>,
) -> Result<Frontiers, FrontierError> {
    let FrontierRequest { level, size_min, frontiers_max, .. } = *request;
    let standoff_m = standoff_m(view.lattice(), request)?;
    let ranges = ranges(view.lattice(), request)?;
    let window = Window::of(view, level, ranges, stop);
    let mut frontier = window.frontier(view, stop);
    let voxels_total = frontier.count();
    let mut clusters: Vec<Cluster> = Vec::new();
    while let Some(cluster) = frontier.take_cluster() {
        view.give_way(stop);
        if stop.is_stopped() {
            break;
        }
        if cluster.len() as u64 >= size_min {
            clusters.push(cluster);
        }
    }
    // As they were found where they are as large.
    clusters.sort_by_key(|cluster| std::cmp::Reverse(cluster.len()));
    let told = stop.paced(clusters.iter().take(frontiers_max), 1);
    let look = |cluster| {
        view.give_way(stop);
        window.told(cluster, &Lookout::new(view.view(), level, standoff_m))
    };
    let frontiers = told.map(look).collect();
    Ok(Frontiers { frontiers, frontiers_total: clusters.len() as u64, voxels_total })
}

/// The first and the last index of the voxels of the box, along each axis.
fn ranges(lattice: &Lattice, request: &FrontierRequest) -> Result<[[i32; 2]; 3], FrontierError> {
    let FrontierRequest { level, min_m, max_m, cells_max, .. } = *request;
    let is_box =
        (0..3).all(|axis| min_m[axis] <= max_m[axis] && min_m[axis].is_finite() && max_m[axis].is_finite());
    if !is_box {
        return Err(FrontierError::Corners(min_m, max_m));
    }
    let (low_m, end_m) = lattice.range_m();
    for (field, value) in [("min_m", min_m), ("max_m", max_m)] {
        if !value.iter().all(|c| (low_m..=end_m).contains(c)) {
            return Err(FrontierError::Range { field, value, min_m: low_m, end_m });
        }
    }
    let ranges: [[i32; 2]; 3] = std::array::from_fn(|axis| {
        window::within_lattice(indices_in(lattice, level, [min_m[axis], max_m[axis]]), level)
    });
    let cells =
        ranges.iter().map(|[first, last]| (f64::from(*last) - f64::from(*first) + 1.0).max(0.0)).product();
    let most = cells_max.min(CELLS_MAX);
    if cells > most as f64 {
        return Err(FrontierError::Cells { cells, level, most });
    }
    Ok(ranges)
}

/// The lowest and the highest index of voxels of `level` whose centers lie in a range; in the wrong order where there
/// are none.
fn indices_in(lattice: &Lattice, level: u32, [low_m, high_m]: [f64; 2]) -> [i32; 2] {
    let voxel_m = lattice.resolution_m(level);
    // The voxel that holds the border, from which its center is half a voxel away at most.
    let around = |c: f64| (c / voxel_m).floor().clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)) as i32;
    let center_m = |i: i32| (f64::from(i) + 0.5) * voxel_m;
    let (low, high) = (around(low_m), around(high_m));
    let first = (low - 1..=low + 1).find(|&i| center_m(i) >= low_m).unwrap_or(low + 1);
    let last = (high - 1..=high + 1).rev().find(|&i| center_m(i) <= high_m).unwrap_or(high - 1);
    [first, last]
}

fn standoff_m(lattice: &Lattice, request: &FrontierRequest) -> Result<f64, FrontierError> {
    let (level, voxel_m) = (request.level, lattice.resolution_m(request.level));
    let max_m = STANDOFF_VOXELS_MAX * voxel_m;
    let standoff_m = request.standoff_m.unwrap_or(STANDOFF_VOXELS * voxel_m);
    let is_in_range = standoff_m > 0.0 && standoff_m <= max_m;
    is_in_range.then_some(standoff_m).ok_or(FrontierError::Standoff { standoff_m, max_m, level })
}
