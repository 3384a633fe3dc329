//! A hall with shelves, as robots see it that drive through it.

use mrol::geometry::{Point, Pose};

/// A hall of 24 m by 10 m with shelves, no two alike, as points on its surfaces, meters, a hundred or so on a square
/// meter. None lies on a border between voxels.
pub fn hall() -> Vec<Point> {
    let mut points = Vec::new();
    let mut random = 1u32;
    let mut rectangle = |corner: [f32; 3], [u, v]: [usize; 2], [length, height]: [f32; 2]| {
        for _ in 0..(length * height * 100.0) as usize {
            let mut share = || {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random >> 8) as f32 / (1 << 24) as f32
            };
            let mut point = corner.map(|c| c + 0.043);
            point[u] += share() * length;
            point[v] += share() * height;
            points.push(Point::from(point));
        }
    };
    rectangle([0.0; 3], [0, 1], [24.0, 10.0]);
    for side in [0.0, 10.0] {
        rectangle([0.0, side, 0.0], [0, 2], [24.0, 2.5]);
        rectangle([side * 2.4, 0.0, 0.0], [1, 2], [10.0, 2.5]);
    }
    for (i, x) in [2.0, 5.3, 7.1, 11.2, 14.6, 16.0, 20.3, 22.1].into_iter().enumerate() {
        let (depth, height) = (1.0 + 0.3 * i as f32, 0.8 + 0.2 * i as f32);
        rectangle([x, 0.0, 0.0], [1, 2], [depth, height]);
        rectangle([x, 10.0 - depth, 0.0], [1, 2], [depth, height]);
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
