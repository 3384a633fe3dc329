//! Scans of both sensors in a furnished building.

use nalgebra::{Point3, UnitQuaternion};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::camera::DepthCamera;
use super::lidar::SpinningLidar;
use crate::scene::Scene;
use mrol_map::geometry::{Point, Pose};

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(4)
}

/// In the study's middle, above the furniture's reach.
fn pose(rotation: UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(nalgebra::Translation3::new(4.6, 6.9, 1.1), rotation)
}

/// Camera axes (right, down, forward) from a level robot's (forward, left, up).
fn forward() -> UnitQuaternion<f64> {
    use std::f64::consts::FRAC_PI_2;
    UnitQuaternion::from_euler_angles(-FRAC_PI_2, 0.0, -FRAC_PI_2)
}

fn finite(points: &[Point]) -> usize {
    points.iter().filter(|point| point.is_finite()).count()
}

#[test]
fn one_seed_gives_one_scan() {
    let scene = Scene::furnished(1);
    let scan = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let camera = DepthCamera::default().scan(&scene, &pose(forward()), &mut rng);
        let lidar = SpinningLidar::default().scan(&scene, &pose(UnitQuaternion::identity()), &mut rng);
        // As bytes, for NaN differs from itself.
        bytemuck::cast_slice::<Point, u8>(&[camera, lidar].concat()).to_vec()
    };
    assert_eq!(scan(1), scan(1));
    assert_ne!(scan(1), scan(2));
}

#[test]
fn without_noise_every_return_lies_on_a_surface() {
    let scene = Scene::furnished(1);
    let camera = DepthCamera { noise_at_1m_m: 0.0, dropout: 0.0, ..DepthCamera::default() };
    let map_from_sensor = pose(forward());
    let points = camera.scan(&scene, &map_from_sensor, &mut rng());
    for point in points.iter().filter(|point| point.is_finite()) {
        let direction = point.to_f64().coords;
        let origin = Point3::from(map_from_sensor.translation.vector);
        let distance = scene.cast(origin, map_from_sensor.rotation * direction, 2.0).unwrap();
        assert!((distance - 1.0).abs() < 1e-5, "{distance}");
    }
}

#[test]
fn a_camera_looks_forward_with_x_right_and_y_down() {
    let camera = DepthCamera { noise_at_1m_m: 0.0, dropout: 0.0, ..DepthCamera::default() };
    let points = camera.scan(&Scene::furnished(1), &pose(forward()), &mut rng());
    assert_eq!(points.len(), 160 * 120);
    assert!(points.iter().filter(|p| p.is_finite()).all(|p| p.xyz()[2] > 0.29 && p.xyz()[2] < 6.01));
    // The bottom row's middle sees the floor, 1.1 m below.
    let [_, y, z] = points[119 * 160 + 80].xyz();
    assert!((y - 1.1).abs() < 1e-5 && z < 2.5, "{y} {z}");
}

#[test]
fn a_lidar_sees_all_around_and_z_up() {
    let lidar = SpinningLidar { noise_m: 0.0, dropout: 0.0, ..SpinningLidar::default() };
    let points = lidar.scan(&Scene::furnished(1), &pose(UnitQuaternion::identity()), &mut rng());
    assert_eq!(points.len(), 32 * 900);
    assert_eq!(finite(&points), points.len());
    let z = |p: &&Point| p.xyz()[2];
    let (low, high) = points.iter().fold((0f32, 0f32), |(l, h), p| (l.min(z(&p)), h.max(z(&p))));
    assert!((low + 1.1).abs() < 1e-5 && (high - 1.6).abs() < 1e-5, "{low} {high}");
    for quadrant in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
        let inside = |p: &Point| (0..2).all(|i| p.xyz()[i] * quadrant[i] > 0.0);
        assert!(points.iter().filter(|p| inside(p)).count() > 7000);
    }
}

#[test]
fn noise_and_dropouts_are_as_large_as_set() {
    let scene = Scene::furnished(1);
    let exact = DepthCamera { noise_at_1m_m: 0.0, dropout: 0.0, ..DepthCamera::default() };
    let noisy = DepthCamera { noise_at_1m_m: 0.002, dropout: 0.1, ..DepthCamera::default() };
    let [exact, noisy] = [exact, noisy].map(|camera| camera.scan(&scene, &pose(forward()), &mut rng()));
    let lost = 1.0 - finite(&noisy) as f64 / finite(&exact) as f64;
    assert!((lost - 0.1).abs() < 0.01, "{lost}");
    let pairs = exact.iter().zip(&noisy).map(|(a, b)| (a.to_f64().z, b.to_f64().z));
    let errors: Vec<f64> =
        pairs.filter(|(a, b)| (a + b).is_finite()).map(|(a, b)| (b - a) / (a * a)).collect();
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((deviation - 0.002).abs() < 0.0001, "{deviation}");
}

#[test]
fn what_lies_out_of_range_is_nan() {
    let near = SpinningLidar { range_max_m: 1.5, dropout: 0.0, ..SpinningLidar::default() };
    let points = near.scan(&Scene::furnished(1), &pose(UnitQuaternion::identity()), &mut rng());
    assert!(finite(&points) < points.len() / 2);
    assert!(points.iter().all(|p| p.is_finite() || p.xyz().iter().all(|c| c.is_nan())));
}
