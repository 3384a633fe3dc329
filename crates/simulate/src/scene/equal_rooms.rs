//! Two rooms without doors that look the same, for robots that are carried from one to the other.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::building::CEILING_M;
use super::object::Object;
use super::shape::Shape;

const LENGTH_M: f64 = 7.0;
const WIDTH_M: f64 = 5.0;
const WALL_M: f64 = 0.2;
const CUPBOARDS: u32 = 5;

/// The objects of both rooms; the second is the first, moved by `apart_m` along x.
pub(super) fn equal_rooms(seed: u64, apart_m: f64) -> Vec<Object> {
    let room = room(seed);
    let other: Vec<Object> = room.iter().map(|object| object.placed(apart_m, 0.0, 0.0)).collect();
    [room, other].concat()
}

/// A room between (0, 0) and (7, 5) with cupboards along the walls, none like another.
fn room(seed: u64) -> Vec<Object> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let slab = |z| Shape::cuboid([LENGTH_M / 2.0, WIDTH_M / 2.0, z], [LENGTH_M, WIDTH_M, WALL_M]);
    let wall = |x, y, length, width| Shape::cuboid([x, y, 0.0], [length, width, CEILING_M]);
    let mut shapes = vec![slab(-WALL_M), slab(CEILING_M)];
    for side in [-WALL_M / 2.0, WIDTH_M + WALL_M / 2.0] {
        shapes.push(wall(LENGTH_M / 2.0, side, LENGTH_M, WALL_M));
    }
    for side in [-WALL_M / 2.0, LENGTH_M + WALL_M / 2.0] {
        shapes.push(wall(side, WIDTH_M / 2.0, WALL_M, WIDTH_M));
    }
    for i in 0..CUPBOARDS {
        let (length, depth, height) =
            (random.random_range(0.4..1.3), random.random_range(0.3..0.8), random.random_range(0.6..2.2));
        let x = 0.8 + f64::from(i) * 1.35;
        let y = if i % 2 == 0 { depth / 2.0 } else { WIDTH_M - depth / 2.0 };
        shapes.push(Shape::cuboid([x, y, 0.0], [length, depth, height]));
    }
    shapes.into_iter().map(|shape| Object::new(vec![shape])).collect()
}
