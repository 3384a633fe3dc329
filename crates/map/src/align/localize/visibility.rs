//! Visibility: what the sensor looked through cannot be occupied.

use super::dilated::DilatedLevels;
use super::distance_field::DISTANCE_MAX;
use super::sample::SearchSample;
use crate::geometry::Pose;
use crate::util::StopSignal;

/// Distance to the nearest occupied voxel, in voxels, at which a ray counts as out in the open again.
const OPEN: u8 = 3;
/// Length of a ray within occupied voxels, in voxels, from which on it counts as passing through them and not past
/// their corners.
const THROUGH: f32 = 1.0;
/// Step along a ray near occupied voxels, in voxels.
const STEP: f32 = 0.5;
/// Step along a ray where nothing is near, in voxels.
const OPEN_STEP: f32 = DISTANCE_MAX as f32;

/// Rays that are followed between two checks of the stop signal, each by at most two steps for each voxel along the
/// grid's diagonal.
const RAYS_PER_LOOK: usize = 16;

/// Share of the sample's rays that pass through occupied voxels and come out behind them before they reach their
/// points; 0 without points.
///
/// A ray has to come out again: along a floor it is within occupied voxels for meters before it ends there. The paper
/// stores no free space (III-B); this is the converse, the rays of one scan against the occupied voxels. Once stopped,
/// the result is meaningless.
pub(super) fn blocked_share(
    levels: &DilatedLevels,
    sample: &SearchSample,
    map_from_sensor: &Pose,
    stop: StopSignal<'_>,
) -> f64 {
    let field = levels.finest();
    let place = |point_m: nalgebra::Point3<f64>| field.in_grid(point_m.coords.into()).map(|c| c as f32);
    let origin = place(map_from_sensor.translation.vector.into());
    let is_blocked = |point: &&nalgebra::Point3<f64>| {
        let end = place(map_from_sensor * **point);
        let toward: [f32; 3] = std::array::from_fn(|axis| end[axis] - origin[axis]);
        let length = toward.iter().map(|c| c * c).sum::<f32>().sqrt();
        // Beyond the precision of f32, which is nowhere on a map.
        if !length.is_finite() {
            return false;
        }
        // Outside of the grid nothing is near: the ray skips it in whole steps.
        let Some((enters, leaves)) = field.crossed_by(origin, toward) else { return false };
        let open_steps = (enters * length / OPEN_STEP).floor().max(0.0);
        let end = length.min(leaves * length + 2.0 * OPEN_STEP);
        let (mut way, mut run, mut inside) = (open_steps * OPEN_STEP, 0.0, false);
        while way < end {
            let distance = field.at(std::array::from_fn(|axis| origin[axis] + toward[axis] * (way / length)));
            run = if distance == 0 { run + STEP } else { 0.0 };
            inside |= run >= THROUGH;
            if inside && distance >= OPEN {
                return true;
            }
            // Nothing is nearer than the distance, less the voxel that the ray is in.
            way += f32::from(distance.saturating_sub(1)).max(STEP);
        }
        false
    };
    let rays = sample.points.chunks(RAYS_PER_LOOK).take_while(|_| !stop.is_stopped());
    let blocked: usize = rays.map(|rays| rays.iter().filter(is_blocked).count()).sum();
    blocked as f64 / sample.points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::localize::settings::LocalizationSettings;
    use crate::geometry::Point;
    use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};

    fn plane(x: f32, y: std::ops::Range<i32>) -> impl Iterator<Item = Point> {
        y.flat_map(move |y| (-20..20).map(move |z| Point::new(x, y as f32 * 0.05, z as f32 * 0.05)))
    }

    /// The share of the rays from the origin to a wall at 4 m, in a map that holds it and `more`.
    fn blocked(more: Vec<Point>) -> f64 {
        let wall: Vec<Point> = plane(4.0, -20..20).collect();
        let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let all = [wall.clone(), more].concat();
        map.committer().insert_scan(ScanRecord::of_points(pose, &all, map.lattice()));
        let sample = SearchSample::of(&wall, 200, 0, StopSignal::NEVER);
        let levels = DilatedLevels::of_all(&map, &sample, &LocalizationSettings::default());
        blocked_share(&levels, &sample, &Pose::identity(), StopSignal::NEVER)
    }

    #[test]
    fn a_wall_in_between_blocks_the_rays_through_it() {
        assert_eq!(blocked(Vec::new()), 0.0);
        assert_eq!(blocked(plane(2.0, -30..30).collect()), 1.0);
        let half = blocked(plane(2.0, -30..0).collect());
        assert!((0.4..0.6).contains(&half), "{half}");
    }

    #[test]
    fn a_floor_that_rays_graze_and_a_wall_behind_block_nothing() {
        let floor =
            (0..80).flat_map(|x| (-30..30).map(move |y| Point::new(x as f32 * 0.05, y as f32 * 0.05, -1.05)));
        assert_eq!(blocked(floor.collect()), 0.0);
        assert_eq!(blocked(plane(6.0, -30..30).collect()), 0.0);
    }

    #[test]
    fn a_ray_to_a_far_return_takes_no_steps_outside_the_grid() {
        let wall: Vec<Point> = plane(4.0, -20..20).collect();
        let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        map.committer().insert_scan(ScanRecord::of_points(pose, &wall, map.lattice()));
        let near = SearchSample::of(&wall, 200, 0, StopSignal::NEVER);
        let levels = DilatedLevels::of_all(&map, &near, &LocalizationSettings::default());
        // So far that a step of half a voxel is lost in the numbers.
        let far = |x: f32| SearchSample::of(&[Point::new(x, 0.0, 0.0)], 1, 0, StopSignal::NEVER);
        let seen_from = |sample: &SearchSample, x: f64| {
            blocked_share(&levels, sample, &Pose::translation(x, 0.0, 0.0), StopSignal::NEVER)
        };
        for range in [1e5, 1e9, 1e15] {
            assert_eq!(seen_from(&far(range), 0.0), 1.0, "through the wall, {range} m away");
            assert_eq!(seen_from(&far(-range), 0.0), 0.0, "away from it, {range} m away");
            assert_eq!(seen_from(&far(range), -1e3), 1.0, "from outside the grid, {range} m away");
        }
        assert_eq!(seen_from(&far(1e30), 0.0), 0.0);
    }
}
