//! Frontiers: where free space ends and nothing is known beyond, and from where each can be seen. What explorers go to.

mod clusters;
#[cfg(test)]
mod tests;
mod view_pose;
mod window;

use super::grid::band_of;
use crate::geometry::Pose;
use crate::map::MapView;
use crate::util::StopSignal;
use clusters::Cluster;
use view_pose::Lookout;
use window::Window;

/// How far from a frontier it is looked at where nobody says, in voxels of the level.
pub const STANDOFF_VOXELS: f64 = 20.0;
/// Largest distance from which a frontier is looked at, in voxels of the level.
pub const STANDOFF_VOXELS_MAX: f64 = 256.0;
/// Most voxels of a box, whatever the request says: their places and those around are numbers of 32 bits.
const CELLS_MAX: usize = u32::MAX as usize / 32;
/// Least number of voxels of a frontier where nobody says.
pub const FRONTIER_SIZE_MIN_DEFAULT: u64 = 8;

/// Where to look for frontiers, and which.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierRequest {
    /// Level of the voxels.
    pub level: u32,
    /// Smallest coordinates of the box that is looked into, meters: voxels belong to it whose centers lie in it.
    pub min_m: [f64; 3],
    /// Largest coordinates.
    pub max_m: [f64; 3],
    /// Least number of voxels of a frontier that is told.
    pub size_min: u64,
    /// Most frontiers that are told, the largest.
    pub frontiers_max: usize,
    /// How far from the middle of a frontier it is looked at, meters; [`STANDOFF_VOXELS`] voxels without.
    pub standoff_m: Option<f64>,
    /// Most voxels of the box.
    pub cells_max: usize,
}

/// A frontier: free voxels beside unknown ones that hang together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frontier {
    /// Number of voxels.
    pub voxels: u64,
    /// The mean of their centers, meters.
    pub center_m: [f64; 3],
    /// The box that holds them, borders of voxels: smallest coordinates, meters.
    pub min_m: [f64; 3],
    /// Largest coordinates.
    pub max_m: [f64; 3],
    /// From where it can be seen, where such a place was found.
    pub view: Option<FrontierView>,
}

/// A place from which a frontier can be seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierView {
    /// The place, in a free voxel, and the way it looks: x forward, y to the left and level.
    pub map_from_view: Pose,
    /// The center of the voxel that it looks at, meters: the one of the frontier that is nearest to its mean.
    pub target_m: [f64; 3],
    /// Direction of the look from x to y, radians.
    pub yaw_rad: f64,
    /// How far up it looks, radians; negative for down.
    pub elevation_rad: f64,
}

/// The frontiers of a box, the largest first; of those as large, the one whose first voxel has the smaller z, then y, then x.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frontiers {
    /// Those that are told.
    pub frontiers: Vec<Frontier>,
    /// How many there are of the least size or larger, told or not.
    pub frontiers_total: u64,
    /// How many voxels of the box are frontiers, those of small ones too.
    pub voxels_total: u64,
}

/// Why frontiers cannot be looked for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FrontierError {
    /// Corners that are not finite or in the wrong order.
    #[error("box: min_m must be finite and not exceed max_m, got {0:?} and {1:?}")]
    Corners([f64; 3], [f64; 3]),
    /// Too many voxels.
    #[error("box: {cells} voxels of level {level}, at most {most} are looked at")]
    Cells {
        /// Voxels of the box.
        cells: f64,
        /// The level.
        level: u32,
        /// Most voxels.
        most: usize,
    },
    /// A distance that is no number above 0, or too large.
    #[error(
        "standoff_m must lie above 0 and at most {max_m} m, {STANDOFF_VOXELS_MAX} voxels of level {level}, got {standoff_m}"
    )]
    Standoff {
        /// The distance, meters.
        standoff_m: f64,
        /// The largest one, meters.
        max_m: f64,
        /// The level.
        level: u32,
    },
}

/// The frontiers of a box: voxels of `level` that are free and beside which, along an axis, one is unknown, in the box or just
/// outside. Voxels of a frontier touch each other, at least at corners.
///
/// Free is what [`classify_points`](super::classify_points) says of a voxel's center, so that the view needs viewpoints. Each frontier
/// is told with a place from which a line to its middle runs through free voxels alone: as far away as is asked for, or else no
/// nearer to what ends the line than to the frontier, and rather on the side where nothing is unknown.
///
/// The view must cover the whole map. Takes half a byte a voxel of the box, and 4 a voxel of a frontier. Once stopped, some
/// are missing.
///
/// # Errors
/// For corners that make no box, a box of too many voxels, and a distance out of range.
pub fn list_frontiers(
    view: &MapView<'_>,
    request: &FrontierRequest,
    stop: StopSignal<'_>,
) -> Result<Frontiers, FrontierError> {
    let FrontierRequest { level, size_min, frontiers_max, .. } = *request;
    let standoff_m = standoff_m(view, request)?;
    let window = Window::of(view, level, ranges(view, request)?, stop);
    let mut frontier = window.frontier();
    let voxels_total = frontier.count();
    let mut clusters: Vec<Cluster> = Vec::new();
    while let Some(cluster) = frontier.take_cluster() {
        if stop.is_stopped() {
            break;
        }
        if cluster.len() as u64 >= size_min {
            clusters.push(cluster);
        }
    }
    // As they were found where they are as large.
    clusters.sort_by_key(|cluster| std::cmp::Reverse(cluster.len()));
    let lookout = Lookout::new(view, level, standoff_m);
    let told = stop.paced(clusters.iter().take(frontiers_max), 1);
    let frontiers = told.map(|cluster| window.told(cluster, &lookout)).collect();
    Ok(Frontiers { frontiers, frontiers_total: clusters.len() as u64, voxels_total })
}

/// The first and the last index of the voxels of the box, along each axis.
fn ranges(view: &MapView<'_>, request: &FrontierRequest) -> Result<[[i32; 2]; 3], FrontierError> {
    let FrontierRequest { level, min_m, max_m, cells_max, .. } = *request;
    let is_box =
        (0..3).all(|axis| min_m[axis] <= max_m[axis] && min_m[axis].is_finite() && max_m[axis].is_finite());
    if !is_box {
        return Err(FrontierError::Corners(min_m, max_m));
    }
    let ranges: [[i32; 2]; 3] = std::array::from_fn(|axis| {
        window::within_lattice(band_of(view.lattice(), level, [min_m[axis], max_m[axis]]), level)
    });
    let cells =
        ranges.iter().map(|[first, last]| (f64::from(*last) - f64::from(*first) + 1.0).max(0.0)).product();
    let most = cells_max.min(CELLS_MAX);
    if cells > most as f64 {
        return Err(FrontierError::Cells { cells, level, most });
    }
    Ok(ranges)
}

fn standoff_m(view: &MapView<'_>, request: &FrontierRequest) -> Result<f64, FrontierError> {
    let (level, voxel_m) = (request.level, view.lattice().resolution_m(request.level));
    let max_m = STANDOFF_VOXELS_MAX * voxel_m;
    let standoff_m = request.standoff_m.unwrap_or(STANDOFF_VOXELS * voxel_m);
    let is_in_range = standoff_m > 0.0 && standoff_m <= max_m;
    is_in_range.then_some(standoff_m).ok_or(FrontierError::Standoff { standoff_m, max_m, level })
}
