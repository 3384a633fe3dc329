//! A cart that moves on a floor.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::place::{Surface, append};
use mrol_map::geometry::Pose;
use mrol_map::planning::{Body, Link, PlanningError, Sphere};

/// From one pose of a rollout to the next, seconds.
const STEP_S: f64 = 0.1;
/// Largest speed, meters a second, and largest turn, radians a second.
const SPEED_MAX: f64 = 1.0;
const TURN_MAX: f64 = 1.0;

/// The cart: 20 spheres of 6 to 10 cm that fill 0.7 x 0.4 x 0.4 m.
pub(crate) fn body() -> Result<Body, PlanningError> {
    let sphere = |n: usize| {
        let at = |i: usize, count: usize, size: f32| size * (i as f32 / (count - 1) as f32 - 0.5);
        let center_m = [at(n % 5, 5, 0.56), at(n / 5 % 2, 2, 0.2), at(n / 10, 2, 0.2)];
        Sphere { center_m, radius_m: 0.06 + 0.01 * (n % 5) as f32 }
    };
    of_spheres((0..20).map(sphere))
}

/// The cart as a controller sees it: four spheres of 15 cm, one at each corner.
pub(crate) fn footprint() -> Result<Body, PlanningError> {
    let sphere = |(x, y)| Sphere { center_m: [x, y, 0.0], radius_m: 0.15 };
    of_spheres([(-0.2, -0.1), (-0.2, 0.1), (0.2, -0.1), (0.2, 0.1)].into_iter().map(sphere))
}

fn of_spheres(spheres: impl Iterator<Item = Sphere>) -> Result<Body, PlanningError> {
    Body::new(vec![Link { spheres: spheres.collect(), ..Link::default() }])
}

/// A motion of a body that stands upright: two poses `length_m` apart, in one plane, with a turn of up to 30 degrees.
pub(crate) fn motion(surface: &Surface, length_m: f64, random: &mut ChaCha8Rng) -> Vec<f32> {
    let from = Vector3::from(surface.near(random));
    let (heading, turn) = (random.random_range(-3.0f64..3.0), random.random_range(-0.5..0.5));
    let to = from + Vector3::new(heading.cos(), heading.sin(), 0.0) * length_m;
    let mut numbers = Vec::new();
    append_upright(&mut numbers, from, heading);
    append_upright(&mut numbers, to, heading + turn);
    numbers
}

/// What a sampling controller asks about in one cycle: `rollouts` ways from one place on, each of `steps` poses at
/// random speeds and turns that change on the way.
pub(crate) fn rollouts(
    surface: &Surface,
    (rollouts, steps): (usize, usize),
    random: &mut ChaCha8Rng,
) -> Vec<f32> {
    let (start, toward) = (Vector3::from(surface.near(random)), random.random_range(-3.0f64..3.0));
    let mut numbers = Vec::new();
    for _ in 0..rollouts {
        let (mut place, mut heading) = (start, toward);
        let (mut speed, mut turn) = (random.random_range(0.0..SPEED_MAX), 0.0f64);
        for _ in 0..steps {
            speed = (speed + random.random_range(-0.1..0.1)).clamp(0.0, SPEED_MAX);
            turn = (turn + random.random_range(-0.3..0.3)).clamp(-TURN_MAX, TURN_MAX);
            heading += turn * STEP_S;
            place += Vector3::new(heading.cos(), heading.sin(), 0.0) * speed * STEP_S;
            append_upright(&mut numbers, place, heading);
        }
    }
    numbers
}

fn append_upright(numbers: &mut Vec<f32>, place: Vector3<f64>, yaw: f64) {
    let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
    append(numbers, &Pose::from_parts(Translation3::from(place), rotation));
}
