//! The hall: one large room, for robots that drive faster than between furniture.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::building::CEILING_M;
use super::object::Object;
use super::shape::Shape;

const LENGTH_M: f64 = 20.0;
const WIDTH_M: f64 = 14.0;
const WALL_M: f64 = 0.2;
const PILLAR_M: f64 = 0.3;
const CUPBOARDS: u32 = 12;

/// The objects of the hall: floor, ceiling, walls, pillars, and cupboards along the walls.
pub(super) fn hall(seed: u64) -> Vec<Object> {
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
    for x in [3.0, 10.0, 16.5] {
        for y in [2.2, 11.9] {
            shapes.push(Shape::cylinder([x, y, 0.0], PILLAR_M, CEILING_M));
        }
    }
    for i in 0..CUPBOARDS {
        let (x, depth) =
            (1.0 + f64::from(i % 6) * 3.2 + random.random_range(0.0..1.0), random.random_range(0.3..0.9));
        let y = if i < CUPBOARDS / 2 { depth / 2.0 } else { WIDTH_M - depth / 2.0 };
        let (length, height) = (random.random_range(0.5..1.9), random.random_range(0.5..2.2));
        shapes.push(Shape::cuboid([x, y, 0.0], [length, depth, height]));
    }
    shapes.into_iter().map(|shape| Object::new(vec![shape])).collect()
}
