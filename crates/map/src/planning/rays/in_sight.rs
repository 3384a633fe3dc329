//! Rays that unknown space ends: they go voxel by voxel, as far as scans saw.

use super::hits::RayHits;
use super::ray::Ray;
use super::rays_in_cells::Request;
use super::request::RayError;
use super::space::{Space, Step};
use crate::map::{MapView, ShapeRay};
use crate::planning::effort::Effort;
use crate::planning::unknown::FreeSpace;
use crate::util::StopSignal;
use crate::voxel::Cluster;

/// What a voxel costs, in units of effort.
const VOXEL_EFFORT: u32 = 4;

/// Walks all rays of a request through free voxels of `level` and sets what they hit.
pub(super) fn walk(
    mut space: Space<'_>,
    request: &Request<'_>,
    (level, mut free_space): (u32, FreeSpace<'_>),
    hits: &mut RayHits,
    stop: StopSignal<'_>,
) -> Result<(), RayError> {
    let effort = Effort::until(stop);
    for number in 0..request.rays.len() {
        let (ray, range_m) = request.ray(number)?;
        let Some(mut walk) = space.walk(number, ray, range_m) else {
            return Err(leaves(request, number, 0.0));
        };
        loop {
            effort.spend(VOXEL_EFFORT);
            if effort.is_stopped() {
                return Ok(());
            }
            match space.step_in_sight(&mut walk, level, &mut free_space) {
                Step::Further => {}
                Step::Hit(distance_m, voxel) => {
                    hits.set(number, distance_m, voxel);
                    break;
                }
                Step::Missed if walk.end_m() < range_m => {
                    return Err(leaves(request, number, walk.end_m()));
                }
                Step::Missed => break,
            }
        }
    }
    Ok(())
}

/// A ray that left the lattice so far from its origin.
fn leaves(request: &Request<'_>, at: usize, left_m: f64) -> RayError {
    let (min_m, end_m) = request.range_m;
    RayError::Leaves { at, left_m, min_m, end_m }
}

/// How far a line runs through free voxels of `level` alone and outside of the view's keep-outs, up to `most_m` meters.
pub(in crate::planning) fn clear_m(
    view: &MapView<'_>,
    level: u32,
    free_space: &mut FreeSpace<'_>,
    line: &ShapeRay,
    most_m: f64,
) -> f64 {
    let (nothing, tier) = (Cluster::default(), view.tier_view(level));
    let cell_m = tier.cell_m();
    let ray = Ray::new(line.origin_m.map(|c| c / cell_m), line.direction, cell_m);
    let mut space = Space::new(tier, view.lattice_bounds(level), &nothing);
    let Some(mut walk) = space.walk(0, ray, most_m) else { return 0.0 };
    let clear_m = loop {
        match space.step_in_sight(&mut walk, level, free_space) {
            Step::Further => {}
            Step::Hit(at_m, _) => break at_m,
            // It ended, or the lattice did.
            Step::Missed => break walk.at_m().min(most_m),
        }
    };
    let shapes = view.keep_outs().into_iter().flat_map(|keep_outs| keep_outs.iter());
    shapes.filter_map(|keep_out| keep_out.shape.entered_m(line)).fold(clear_m, f64::min)
}
