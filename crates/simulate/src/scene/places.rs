//! Places that a robot mistakes itself in: rooms that look alike turned around, and aisles that repeat.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::building::CEILING_M;
use super::furniture::Kind;
use super::object::Object;
use super::shape::Shape;

const WALL_M: f64 = 0.2;
/// Room that is left free about the middle of a room, where robots stand.
const FREE_M: f64 = 1.0;
const KINDS: [Kind; 9] = [
    Kind::Table,
    Kind::Chair,
    Kind::Shelf,
    Kind::Cupboard,
    Kind::Sofa,
    Kind::Plant,
    Kind::Lamp,
    Kind::Ball,
    Kind::Crates,
];

/// The walls, floor and ceiling of a room of `length_m` x `width_m` about the origin.
fn shell(length_m: f64, width_m: f64) -> Vec<Object> {
    let slab = |z| Shape::cuboid([0.0, 0.0, z], [length_m + 1.0, width_m + 1.0, WALL_M]);
    let mut shapes = vec![slab(-WALL_M), slab(CEILING_M)];
    for side in [-1.0, 1.0] {
        let (x, y) = (side * (length_m + WALL_M) / 2.0, side * (width_m + WALL_M) / 2.0);
        shapes.push(Shape::cuboid([x, 0.0, 0.0], [WALL_M, width_m, CEILING_M]));
        shapes.push(Shape::cuboid([0.0, y, 0.0], [length_m + 2.0 * WALL_M, WALL_M, CEILING_M]));
    }
    shapes.into_iter().map(|shape| Object::new(vec![shape])).collect()
}

/// A rectangular room about the origin with `pieces` of furniture, of kinds, sizes and places drawn from `seed`, none
/// within a meter of its middle. The first `moved` of them were carried to other places since.
pub(super) fn rectangular_room(
    seed: u64,
    [length_m, width_m]: [f64; 2],
    pieces: usize,
    moved: usize,
) -> Vec<Object> {
    let (mut random, mut elsewhere) = (ChaCha8Rng::seed_from_u64(seed), ChaCha8Rng::seed_from_u64(!seed));
    let place = |random: &mut ChaCha8Rng| {
        let [x, y] = [length_m, width_m].map(|side_m| random.random_range(-0.5..0.5) * (side_m - 1.6));
        (x, y, random.random_range(0.0..TAU))
    };
    let is_free = |&(x, y, _): &(f64, f64, f64)| x.hypot(y) > FREE_M + 0.8;
    let mut objects = shell(length_m, width_m);
    let mut placed = 0;
    while placed < pieces {
        let piece = KINDS[random.random_range(0..KINDS.len())].build(&mut random);
        let drawn = Some(place(&mut random)).filter(is_free);
        let now = drawn.map(|drawn| match placed < moved {
            true => std::iter::repeat_with(|| place(&mut elsewhere)).find(is_free).unwrap_or(drawn),
            false => drawn,
        });
        if let Some((x, y, yaw)) = now {
            objects.push(piece.placed(x, y, yaw));
            placed += 1;
        }
    }
    objects
}

/// An aisle along x between two rows of shelves with an upright every `period_m`, in a hall of `length_m` whose ends
/// lie at 0 and there; what lies on the shelves is the same in every bay.
pub(super) fn aisle(period_m: f64, length_m: f64) -> Vec<Object> {
    let (width_m, depth_m) = (3.0, 0.8);
    let hall = shell(length_m, width_m + 2.0 * depth_m + 0.1);
    let mut objects: Vec<Object> =
        hall.iter().map(|object| object.placed(length_m / 2.0, 0.0, 0.0)).collect();
    for side in [-1.0, 1.0] {
        let y = side * (width_m + depth_m) / 2.0;
        let mut shapes: Vec<Shape> = [0.1, 0.9, 1.7]
            .into_iter()
            .map(|z| Shape::cuboid([length_m / 2.0, y, z], [length_m, depth_m, 0.05]))
            .collect();
        let bays = (length_m / period_m) as usize;
        for bay in 0..=bays {
            let x = bay as f64 * period_m;
            shapes.push(Shape::cuboid([x, y, 0.0], [0.08, depth_m, 2.2]));
            shapes.push(Shape::cuboid([x + period_m * 0.4, y, 0.95], [period_m * 0.3, depth_m * 0.6, 0.4]));
        }
        objects.extend(shapes.into_iter().map(|shape| Object::new(vec![shape])));
    }
    objects
}

/// Level ground under the open sky, and containers around its middle.
pub(super) fn yard(seed: u64) -> Vec<Object> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut shapes = vec![Shape::cuboid([0.0, 0.0, -WALL_M], [120.0, 120.0, WALL_M])];
    for quarter in 0..4 {
        let angle: f64 = (f64::from(quarter) + random.random_range(0.2..0.8)) * FRAC_PI_2;
        let distance = random.random_range(15.0..25.0);
        let place = [distance * angle.cos(), distance * angle.sin(), 0.0];
        shapes.push(Shape::cuboid(place, [random.random_range(2.5..6.0), 2.4, 2.6]));
    }
    shapes.into_iter().map(|shape| Object::new(vec![shape])).collect()
}

/// People that stand about `(x, y)`, at 0.8 to 2.5 m from there, in front of a share of the view.
pub(super) fn crowd(seed: u64, people: usize, [x, y]: [f64; 2]) -> Vec<Object> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let person = |_| {
        let (angle, distance) = (random.random_range(0.0..TAU), random.random_range(0.8..2.5));
        let body = Shape::cylinder([0.0; 3], 0.25, random.random_range(1.5..1.9));
        Object::new(vec![body]).placed(x + distance * angle.cos(), y + distance * angle.sin(), FRAC_PI_2)
    };
    (0..people).map(person).collect()
}
