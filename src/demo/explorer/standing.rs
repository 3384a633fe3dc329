//! The robot's body, and how it stands.

use nalgebra::{Point3, Vector3};

use mrol_map::geometry::Pose;
use mrol_map::map::Region;
use mrol_map::planning::{Body, Link, Sphere};
use mrol_simulate::Scene;

/// Radius of the body, meters.
pub(crate) const BODY_RADIUS_M: f64 = 0.25;
/// Height of the sensor above the floor, meters.
pub(crate) const SENSOR_HEIGHT_M: f64 = 0.9;
/// Heights of the middles of the body's spheres, meters: it is a column of 0.15 to 1.15 m.
const HEIGHTS_M: [f64; 3] = [0.4, 0.65, 0.9];

/// The body of a robot that stands at the origin, with some room around it.
pub(super) fn body(room_m: f32) -> Body {
    let sphere = |z: f64| Sphere { center_m: [0.0, 0.0, z as f32], radius_m: BODY_RADIUS_M as f32 };
    let link = Link { spheres: HEIGHTS_M.map(sphere).to_vec(), padding_m: room_m, ..Link::default() };
    Body::new(vec![link]).unwrap_or_else(|_| unreachable!("its numbers are in range"))
}

/// The space that a robot at x and y takes itself, with all of the voxels of 10 cm that it touches: half their diagonal
/// more.
pub(super) fn own_place([x, y]: [f64; 2]) -> [Region; 3] {
    const MORE_M: f64 = 0.09;
    HEIGHTS_M.map(|z| Region::Sphere { center_m: [x, y, z], radius_m: BODY_RADIUS_M + MORE_M })
}

/// Where the sensor is of a robot that stands at x and y, map_from_sensor.
pub(super) fn pose_at([x, y]: [f64; 2]) -> Pose {
    Pose::translation(x, y, SENSOR_HEIGHT_M)
}

/// True where the body of a robot at x and y really meets nothing of a scene, but for the floor below it.
pub(super) fn stands_free(scene: &Scene, [x, y]: [f64; 2]) -> bool {
    HEIGHTS_M.iter().all(|&z| {
        let center = Point3::new(x, y, z);
        directions().all(|direction| scene.cast(center, direction, BODY_RADIUS_M).is_none())
    })
}

/// Directions all around, some 10 degrees from each other.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    // Points of a spiral from pole to pole lie evenly on the ball.
    const COUNT: usize = 400;
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..COUNT).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / COUNT as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let around = (1.0 - z * z).sqrt();
        Vector3::new(cos * around, sin * around, z)
    })
}
