//! Points among keep-outs: the nearest is a keep-out where one is nearer than all voxels.

use super::nearest_voxels::{Nearest, NearestVoxels};
use crate::geometry::Point;
use crate::planning::effort::Effort;
use crate::planning::keep_outs::Shapes;
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Puts shapes in the place of voxels that are further away, within `radius_m`.
pub(super) fn mend(
    shapes: &Shapes<'_>,
    points: &[Point],
    radius_m: f64,
    nearest: &mut NearestVoxels,
    stop: StopSignal<'_>,
) {
    // Once stopped, there are fewer answers than points.
    let (count, effort) = (nearest.len(), Effort::until(stop));
    for (i, point) in points[..count].iter().enumerate().take_while(|_| effort.goes_on(1)) {
        let at_m = point.xyz().map(f64::from);
        let voxel_m = f64::from(nearest.distances_m[i]);
        let found = shapes.nearest(at_m, radius_m.min(voxel_m), &effort).filter(|_| point.is_finite());
        let Some((distance_m, keep_out)) = found.filter(|(distance_m, _)| *distance_m < voxel_m) else {
            continue;
        };
        let place = keep_out.shape.nearest_place_m(at_m);
        let away =
            std::array::from_fn(
                |axis| {
                    if distance_m > 0.0 { (at_m[axis] - place[axis]) / distance_m } else { 0.0 }
                },
            );
        nearest.set(i, Nearest { distance_m, voxel: VoxelKey::default(), away });
        nearest.keep_outs.resize(count, None);
        nearest.keep_outs[i] = Some(keep_out.name.clone());
    }
}
