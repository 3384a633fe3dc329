//! Sides: points of a scan on surfaces that earlier scans met from the other side, as of a thin wall.
//!
//! A surface is met from one side, and a wall has two. The far face of a wall that was never seen may lie where the
//! near one does, to all that rays can tell, and a refinement puts it there.

use super::agreement::{Rays, spread};
use super::refine::KnownMoments;
use super::sampled_scan::SampledScan;
use super::witnesses::Witnesses;
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::visibility::Sight;

/// Points with which it is found out whether any lie on other sides.
const FEW: usize = 250;
/// Least share of them that do: fewer do not move a scan.
const SHARE_MIN: f64 = 0.02;

/// The surface points of a scan at `pose` that witnesses met from the side of the scan, or did not meet; none where
/// hardly any was met from the other side.
pub(super) fn met_from_own_side(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    pose: &Pose,
    rays: &Rays,
    witnesses: &Witnesses,
) -> Option<Vec<Point>> {
    let moments = KnownMoments::of(map);
    let mut surfaces = scan.surfaces.borrow_mut();
    let sensor_m = pose.translation.vector;
    let mut is_other_side = |point: &Point| {
        let place_m = (pose * point.to_f64()).coords;
        let met_by = witnesses
            .viewpoints
            .iter()
            .filter(|viewpoint| rays.sight_of(viewpoint, pose, *point) == Sight::Agrees);
        let mut sides = met_by.filter_map(|viewpoint| {
            let from_m = viewpoint.map_from_sensor().translation.vector;
            surfaces.is_one_side(&moments, &place_m, [&sensor_m, &from_m])
        });
        let first = sides.next();
        first == Some(false) && !sides.any(|is_one| is_one)
    };
    let few = spread(&scan.surface_sample, FEW);
    let other = few.iter().filter(|point| is_other_side(point)).count();
    if (other as f64) < SHARE_MIN * few.len() as f64 {
        return None;
    }
    Some(scan.surface_sample.iter().filter(|point| !is_other_side(point)).copied().collect())
}
