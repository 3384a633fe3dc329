//! Finding the nearest voxels, and keep-outs that are nearer.

use super::keep_outs;
use super::nearest_voxels::NearestVoxels;
use super::request::{NearestError, NearestRequest, RADIUS_VOXELS_MAX};
use super::search::Search;
use crate::map::MapView;
use crate::planning::keep_outs::Shapes;
use crate::planning::unknown::OutOfRange;
use crate::util::StopSignal;
use crate::voxel::Cluster;

/// Points that are searched between two checks of the stop signal: at worst some milliseconds.
const POINTS_PER_STOP_CHECK: usize = 64;

/// The nearest occupied voxel of each point, within a radius.
///
/// Exact: distances are those of f64, in voxels, from the point to the closed cube from i r_n to (i + 1) r_n, or to its
/// center. A voxel just at the radius is within it. Of voxels equally far, the one of the smallest packed key is taken.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), one that is nearer than all voxels takes their place;
/// distances to it are those to its border, whatever distances to voxels are measured to.
///
/// The view must cover the whole map. Takes 24 bytes a point. Once stopped, the answer has fewer points.
///
/// # Errors
/// When the radius is out of range, and for the first point that lies in no voxel.
pub fn find_nearest(
    view: &MapView<'_>,
    request: &NearestRequest<'_>,
    stop: StopSignal<'_>,
) -> Result<NearestVoxels, NearestError> {
    let NearestRequest { points, level, radius_m, to } = *request;
    let max_m = RADIUS_VOXELS_MAX * view.lattice().resolution_m(level);
    if !(radius_m > 0.0 && radius_m <= max_m) {
        return Err(NearestError::Radius { radius_m, max_m, level });
    }
    OutOfRange::check(points, view.lattice())?;
    let nothing = Cluster::default();
    let mut search = Search::new(view.tier_view(level), &nothing, radius_m, to);
    let mut nearest = NearestVoxels::of_capacity(points.len());
    for &point in stop.paced(points, POINTS_PER_STOP_CHECK) {
        nearest.push(search.nearest(point));
    }
    if let Some(shapes) = Shapes::of(view) {
        keep_outs::mend(&shapes, points, radius_m, &mut nearest, stop);
    }
    Ok(nearest)
}
