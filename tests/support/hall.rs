//! A hall with shelves, as robots see it that drive through it.

use mrol::geometry::{Point, Pose};

/// A hall of 24 m by 10 m with shelves, no two alike, as points on its surfaces, meters.
pub fn hall() -> Vec<Point> {
    let steps = |length: f32| (0..(length / 0.12) as usize).map(|i| i as f32 * 0.12);
    let mut points = Vec::new();
    for x in steps(24.0) {
        points.extend(steps(10.0).map(|y| Point::new(x, y, 0.0)));
        points.extend(steps(2.5).flat_map(|z| [Point::new(x, 0.0, z), Point::new(x, 10.0, z)]));
    }
    for y in steps(10.0) {
        points.extend(steps(2.5).flat_map(|z| [Point::new(0.0, y, z), Point::new(24.0, y, z)]));
    }
    for (i, x) in [2.0, 5.3, 7.1, 11.2, 14.6, 16.0, 20.3, 22.1].into_iter().enumerate() {
        let (depth, height) = (1.0 + 0.3 * i as f32, 0.8 + 0.2 * i as f32);
        for d in steps(depth) {
            points.extend(steps(height).flat_map(|z| [Point::new(x, d, z), Point::new(x, 10.0 - d, z)]));
        }
    }
    points
}

/// The points within 9 m of a sensor at `map_from_sensor`, in its frame, whatever stands before them.
pub fn seen_from(hall: &[Point], map_from_sensor: &Pose) -> Vec<Point> {
    let sensor_from_map = map_from_sensor.inverse();
    let near = |point: &nalgebra::Point3<f64>| point.coords.norm() < 9.0;
    let points =
        hall.iter().map(|point| sensor_from_map * nalgebra::Point3::from(point.xyz().map(f64::from)));
    points.filter(near).map(|point| Point::from([point.x, point.y, point.z].map(|c| c as f32))).collect()
}
