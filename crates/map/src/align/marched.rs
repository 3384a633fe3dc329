//! Marched viewpoints: what earlier scans must have seen, generated from where they were taken (paper III-B).
//!
//! Maps from before viewpoints were kept, and those that keep none, have the poses of their scans. Rays that are cast
//! from there through the map end where those of the scans did, if the map is dense.

use std::f32::consts::FRAC_PI_4;
use std::sync::Arc;

use super::extent::within_extent;
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::planning::{Rays, Toward, cast_rays};
use crate::util::StopSignal;
use crate::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep, Viewpoint};
use crate::voxel::VoxelKey;

/// Scans that are asked for what they saw, at most.
const ORIGINS: usize = 4;
/// A scan leaves a viewpoint unless there is one within half a meter: a scan that is so much nearer than all viewpoints
/// left none, meters.
const NEARER_M: f64 = 2.0;
/// Two scans nearer to each other than this, in voxels, saw the same.
const APART_VOXELS: f64 = 4.0;
/// Poses of the trajectory among which the nearest are looked for, at most: the last ones, at even distances.
const POSES_MAX: usize = 16 << 10;
/// The level that rays are cast on: its voxels close the gaps that the finest leave between the rays of a scan.
const LEVEL: u32 = 1;
/// Rays along the side of each face of a cube: 1.1 degrees apart, hardly more than the finest pixels of a scan's image.
/// Fewer pass between two rings of a lidar, and what they meet behind contradicts points at true poses.
const RAYS_OF_SIDE: usize = 80;
/// What a ray passes before it counts as having met something, voxels of its level: a robot may be in the map itself.
const BEGINS_VOXELS: f32 = 2.0;
/// Rays end here, meters.
const RANGE_MAX_M: f64 = 60.0;

/// What the scans nearest to `pose` (map frame) must have seen where they left no viewpoints: where the nearest one
/// lies `nearest_m` from there, much farther than they do. What is to be seen from the pose itself, where neither scan
/// nor viewpoint is known.
pub(super) fn viewpoints_near(
    map: &MultiResolutionMap,
    pose: &Pose,
    nearest_m: f64,
    wish: usize,
    stop: StopSignal<'_>,
) -> Vec<Arc<Viewpoint>> {
    let mut origins = origins_near(map, pose, wish.min(ORIGINS));
    let distance_m = |origin: &Pose| (origin.translation.vector - pose.translation.vector).norm();
    match origins.first() {
        None if nearest_m.is_infinite() => origins.push(*pose),
        Some(nearest) if distance_m(nearest) + NEARER_M < nearest_m => {}
        _ => return Vec::new(),
    }
    origins.iter().filter_map(|origin| Some(Arc::new(viewpoint_at(map, origin, stop)?))).collect()
}

/// Where the scans were taken that are nearest to `pose` and saw different things.
fn origins_near(map: &MultiResolutionMap, pose: &Pose, wish: usize) -> Vec<Pose> {
    let trajectory = map.trajectory();
    let apart_m = APART_VOXELS * map.lattice().resolution_m(0);
    let distance_m = |a: &Pose, b: &Pose| (a.translation.vector - b.translation.vector).norm();
    let stride = trajectory.len().div_ceil(POSES_MAX).max(1);
    let poses = trajectory.poses().rev().step_by(stride).map(|scan| scan.map_from_sensor);
    let mut near: Vec<(f64, Pose)> = poses.map(|origin| (distance_m(&origin, pose), origin)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut origins: Vec<Pose> = Vec::new();
    for (_, origin) in near {
        if origins.len() < wish && origins.iter().all(|other| distance_m(other, &origin) > apart_m) {
            origins.push(origin);
        }
    }
    origins
}

/// What is to be seen from the place of `origin`, by an image whose axes are those of the map; none where nothing is.
fn viewpoint_at(map: &MultiResolutionMap, origin: &Pose, stop: StopSignal<'_>) -> Option<Viewpoint> {
    let level = LEVEL.min(map.settings().levels - 1);
    let cell_m = map.lattice().resolution_m(level) as f32;
    let begins_m = BEGINS_VOXELS * cell_m;
    let place = Point::from(nalgebra::Point3::from(origin.translation.vector));
    let directions = directions();
    let along = |direction: &Point, m: f32| {
        let ([x, y, z], [dx, dy, dz]) = (place.xyz(), direction.xyz());
        Point::new(x + dx * m, y + dy * m, z + dz * m)
    };
    let origins: Vec<Point> = directions.iter().map(|direction| along(direction, begins_m)).collect();
    let rays = Rays {
        origins: &origins,
        toward: Toward::Directions { directions: &directions, range_m: RANGE_MAX_M },
    };
    let long_read = map.long_read();
    let view = long_read.view();
    let hits = cast_rays(&view, &rays, level, stop).ok()?;
    // What was met lies at the finest voxels there: a ray enters a coarse one before them.
    let is_met = |(_, distance_m): &(&VoxelKey, &f32)| distance_m.is_finite();
    let met = hits.voxels.iter().zip(&hits.distances_m).filter(is_met).map(|(voxel, _)| *voxel);
    let finest = view.descendants_of(met, level);
    drop(view);
    drop(long_read);
    let origin_m = origin.translation.vector;
    let offset = |voxel| nalgebra::Vector3::from(map.lattice().center_m(voxel, 0)) - origin_m;
    let ends: Vec<Point> =
        finest.iter().map(|voxel| Point::from(nalgebra::Point3::from(offset(voxel)))).collect();
    let ends = within_extent(&ends, map.lattice().extent_m(), stop);
    let sweep = Sweep::standing(RANGE_MAX_M as f32);
    let image = RangeImage::of_points(&ends, sweep, IMAGE_BYTES_MAX)?;
    Some(Viewpoint::new(Pose::from(origin.translation), image))
}

/// Unit vectors all around, evenly by angle on each face of a cube.
fn directions() -> Vec<Point> {
    let side = |i: usize| (((i as f32 + 0.5) / RAYS_OF_SIDE as f32 * 2.0 - 1.0) * FRAC_PI_4).tan();
    let of_face = |(axis, sign): (usize, f32)| {
        (0..RAYS_OF_SIDE * RAYS_OF_SIDE).map(move |i| {
            let mut along = [0.0; 3];
            along[axis] = sign;
            along[(axis + 1) % 3] = side(i % RAYS_OF_SIDE);
            along[(axis + 2) % 3] = side(i / RAYS_OF_SIDE);
            let [x, y, z] = nalgebra::Vector3::from(along).normalize().into();
            Point::new(x, y, z)
        })
    };
    (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).flat_map(of_face).collect()
}
