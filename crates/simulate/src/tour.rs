//! Two robots' tours through the simulated building.

use super::ride::Ride;
use super::route::{CAMERA_ROUTE, LIDAR_ROUTE};
use super::sensor::{DepthCamera, Sensor, SpinningLidar};
use mrol_map::geometry::Pose;

/// A robot's way through the building and the sensor it carries.
#[derive(Debug, Clone)]
pub struct Tour {
    /// The robot's name: `lidar` or `camera`.
    pub name: &'static str,
    /// The robot's sensor.
    pub sensor: Sensor,
    /// Where the sensor stands for each scan, map_from_sensor.
    pub poses: Vec<Pose>,
}

/// The tours of two robots, `steps` scans each, which keep clear of the furniture of every
/// [`Scene::furnished`](super::Scene::furnished).
///
/// Robot `lidar` goes through all rooms and the corridor: at most 0.35 m and 9 degrees a step, 44 m a lap. Robot
/// `camera` goes through the northern rooms and the corridor, looking to both sides: at most 0.16 m and 5.5
/// degrees a step, 22 m a lap. Both start in the same room, 0.6 m apart, with the same view.
pub fn tours(steps: usize) -> [Tour; 2] {
    let lidar = Sensor::SpinningLidar(SpinningLidar::default());
    let camera = Sensor::DepthCamera(DepthCamera::default());
    [
        Tour { name: "lidar", sensor: lidar, poses: LIDAR_RIDE.poses(steps) },
        Tour { name: "camera", sensor: camera, poses: CAMERA_RIDE.poses(steps) },
    ]
}

/// Length of a lap of robot `lidar`, meters.
pub const LIDAR_LAP_M: f64 = 44.0;

/// Where the sensor of robot `lidar` stands after `way_m` meters, lap after lap, map_from_sensor.
pub fn lidar_at(way_m: f64) -> Pose {
    LIDAR_RIDE.map_from_sensor(way_m)
}

const LIDAR_RIDE: Ride = Ride {
    route: LIDAR_ROUTE,
    height_m: 0.9,
    pitch_down_deg: 0.0,
    is_camera: false,
    glance_deg: 0.0,
    sway_deg: 0.6,
    step_max_m: 0.35,
    turn_max_deg: 9.0,
};

const CAMERA_RIDE: Ride = Ride {
    route: CAMERA_ROUTE,
    height_m: 1.1,
    pitch_down_deg: 10.0,
    is_camera: true,
    glance_deg: 25.0,
    sway_deg: 1.2,
    step_max_m: 0.16,
    turn_max_deg: 5.5,
};

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::{Matrix6, Point3, Vector3, Vector6};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::scene::Scene;
    use mrol_map::geometry::{Point, pose_difference};

    const STEPS: usize = 300;

    fn place(pose: &Pose) -> Point3<f64> {
        pose.translation.vector.into()
    }

    #[test]
    fn steps_are_short_enough_to_align_and_long_enough_to_get_around() {
        for (tour, limits, mean_m) in
            tours(STEPS).iter().zip([(0.35, 9.0), (0.16, 5.5)]).zip([0.25, 0.1]).map(|((t, l), m)| (t, l, m))
        {
            assert_eq!(tour.poses.len(), STEPS);
            let steps: Vec<_> =
                tour.poses.windows(2).map(|pair| pose_difference(&pair[0], &pair[1])).collect();
            assert!(steps.iter().all(|(m, deg)| *m <= limits.0 && *deg <= limits.1 && *m > 0.05));
            let mean = steps.iter().map(|(meters, _)| meters).sum::<f64>() / steps.len() as f64;
            assert!(mean > mean_m, "{mean} m a step");
        }
    }

    #[test]
    fn a_lap_ends_where_it_began() {
        assert!((LIDAR_RIDE.route.length_m() - LIDAR_LAP_M).abs() < 0.5, "{}", LIDAR_RIDE.route.length_m());
        assert!((place(&lidar_at(LIDAR_LAP_M)) - place(&lidar_at(0.0))).norm() < 0.6);
    }

    #[test]
    fn longer_tours_go_on_where_shorter_ones_end() {
        for (long, short) in tours(50).iter().zip(&tours(20)) {
            assert_eq!(long.poses[..20], short.poses);
        }
        assert!(tours(0).iter().all(|tour| tour.poses.is_empty()));
    }

    #[test]
    fn both_robots_start_side_by_side_with_the_same_view() {
        let [lidar, camera] = tours(1).map(|tour| tour.poses[0]);
        assert!((place(&lidar) - place(&camera)).norm() < 0.8);
        let (ahead, view) = (lidar * Vector3::x(), camera * Vector3::z());
        assert!(ahead.angle(&view).to_degrees() < 15.0);
    }

    /// Distance to the nearest surface around `center`, level and at slants, but not to the floor.
    fn clearance_m(scene: &Scene, center: Point3<f64>) -> f64 {
        let directions = (0..180).flat_map(|i| {
            let (sin, cos) = (f64::from(i) * TAU / 180.0).sin_cos();
            [-0.5, 0.0, 0.5].map(|up| Vector3::new(cos, sin, up).normalize())
        });
        directions.filter_map(|direction| scene.cast(center, direction, 5.0)).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn no_robot_comes_near_furniture_or_walls_from_floor_to_sensor_for_any_seed() {
        for seed in 0..8 {
            let scene = Scene::furnished(seed);
            for tour in tours(STEPS) {
                for (step, pose) in tour.poses.iter().enumerate().step_by(3) {
                    for z in [0.3, 0.6, place(pose).z] {
                        let center = Point3::new(place(pose).x, place(pose).y, z);
                        let clearance = clearance_m(&scene, center);
                        assert!(clearance >= 0.25, "{} {step}, seed {seed}: {clearance} m", tour.name);
                    }
                }
            }
        }
    }

    #[test]
    fn no_step_goes_through_anything() {
        let scene = Scene::furnished(5);
        for tour in tours(STEPS) {
            for pair in tour.poses.windows(2) {
                let (from, to) = (place(&pair[0]), place(&pair[1]));
                assert_eq!(scene.cast(from, to - from, 1.0), None);
            }
        }
    }

    /// Least over mean eigenvalue of the point-to-plane Hessian of a scan, its points centered and scaled to a
    /// mean distance of one: zero would mean a motion that leaves the scan on itself.
    fn conditioning(scene: &Scene, tour: &Tour, pose: &Pose) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let (sensor, row) = match &tour.sensor {
            Sensor::DepthCamera(c) => {
                (Sensor::DepthCamera(DepthCamera { noise_at_1m_m: 0.0, ..c.clone() }), c.width_px)
            }
            Sensor::SpinningLidar(l) => {
                (Sensor::SpinningLidar(SpinningLidar { noise_m: 0.0, ..l.clone() }), l.rings)
            }
        };
        let points = sensor.scan(scene, pose, &mut rng);
        hessian_ratio(&points, row as usize)
    }

    fn hessian_ratio(points: &[Point], row: usize) -> f64 {
        let finite: Vec<_> = points.iter().filter(|p| p.is_finite()).map(|p| p.to_f64().coords).collect();
        let center = finite.iter().sum::<Vector3<f64>>() / finite.len() as f64;
        let scale = finite.iter().map(|p| (p - center).norm()).sum::<f64>() / finite.len() as f64;
        let mut hessian = Matrix6::zeros();
        for i in (0..points.len() - row - 1).filter(|i| [0, 1, row].iter().all(|d| points[i + d].is_finite()))
        {
            let [p, right, below] = [0, 1, row].map(|d| points[i + d].to_f64().coords);
            let Some(normal) = (right - p).cross(&(below - p)).try_normalize(1e-12) else {
                continue;
            };
            let turn = ((p - center) / scale).cross(&normal);
            let column = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
            hessian += column * column.transpose();
        }
        let eigenvalues = hessian.symmetric_eigenvalues();
        eigenvalues.min() / eigenvalues.mean()
    }

    #[test]
    fn every_scan_of_both_tours_fixes_all_six_degrees_of_freedom() {
        for seed in [1, 2] {
            let scene = Scene::furnished(seed);
            for tour in tours(STEPS) {
                for (step, pose) in tour.poses.iter().enumerate().step_by(5) {
                    let ratio = conditioning(&scene, &tour, pose);
                    assert!(ratio > 0.05, "{} {step}, seed {seed}: {ratio}", tour.name);
                }
            }
        }
    }
}
