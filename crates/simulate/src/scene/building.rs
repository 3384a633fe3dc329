//! The building: four rooms along a corridor, joined by doors. It is the same for every seed.
//!
//! ```text
//!   y
//!   9 +------------+-------------+
//!     |  study    door   lounge  |
//! 5.5 +---door-----+------door---+
//!     |         corridor         |
//! 3.7 +---door---+--------door---+
//!     | workshop door  archive   |
//!   0 +----------+---------------+
//!     0         6.5 7            14   x
//! ```

use super::object::Object;
use super::shape::Shape;

/// Height of the ceiling, meters.
pub(super) const CEILING_M: f64 = 2.7;

const LENGTH_M: f64 = 14.0;
const WIDTH_M: f64 = 9.0;
const WALL_M: f64 = 0.12;
const DOOR_WIDTH_M: f64 = 1.1;
const DOOR_HEIGHT_M: f64 = 2.1;

/// The y coordinate of the wall between the corridor and the northern rooms, meters.
const NORTH_M: f64 = 5.5;
/// The y coordinate of the wall between the corridor and the southern rooms, meters.
const SOUTH_M: f64 = 3.7;
/// The x coordinate of the wall between the northern rooms, meters.
const NORTH_DIVIDE_M: f64 = 7.0;
/// The x coordinate of the wall between the southern rooms, meters.
const SOUTH_DIVIDE_M: f64 = 6.5;

/// The floor of a room between its walls, map frame, meters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// Extent along x, from and to.
    pub(super) x: (f64, f64),
    /// Extent along y, from and to.
    pub(super) y: (f64, f64),
}

const HALF_WALL_M: f64 = WALL_M / 2.0;
const NORTH_Y: (f64, f64) = (NORTH_M + HALF_WALL_M, WIDTH_M);
const SOUTH_Y: (f64, f64) = (0.0, SOUTH_M - HALF_WALL_M);

pub(super) const STUDY: Room = Room { x: (0.0, NORTH_DIVIDE_M - HALF_WALL_M), y: NORTH_Y };
pub(super) const LOUNGE: Room = Room { x: (NORTH_DIVIDE_M + HALF_WALL_M, LENGTH_M), y: NORTH_Y };
pub(super) const WORKSHOP: Room = Room { x: (0.0, SOUTH_DIVIDE_M - HALF_WALL_M), y: SOUTH_Y };
pub(super) const ARCHIVE: Room = Room { x: (SOUTH_DIVIDE_M + HALF_WALL_M, LENGTH_M), y: SOUTH_Y };
pub(super) const CORRIDOR: Room =
    Room { x: (0.0, LENGTH_M), y: (SOUTH_M + HALF_WALL_M, NORTH_M - HALF_WALL_M) };

/// The objects of the building: floor, ceiling, walls, the pilasters of the corridor and the lamps on the ceiling.
pub(super) fn building() -> Vec<Object> {
    let parts = [slabs(), outer_walls(), inner_walls(), pilasters()].concat();
    parts.into_iter().map(|part| Object::new(vec![part])).chain(hanging_lamps()).collect()
}

fn slabs() -> Vec<Shape> {
    let slab = |z| Shape::cuboid([LENGTH_M / 2.0, WIDTH_M / 2.0, z], [LENGTH_M, WIDTH_M, WALL_M]);
    vec![slab(-WALL_M), slab(CEILING_M)]
}

fn outer_walls() -> Vec<Shape> {
    let along_x = |y: f64| along_x(y, (-WALL_M, LENGTH_M + WALL_M), &[]);
    let along_y = |x: f64| along_y(x, (0.0, WIDTH_M), &[]);
    let (low, long, wide) = (-HALF_WALL_M, LENGTH_M + HALF_WALL_M, WIDTH_M + HALF_WALL_M);
    [along_x(low), along_x(wide), along_y(low), along_y(long)].concat()
}

fn inner_walls() -> Vec<Shape> {
    let doors = [2.5, 11.0];
    [
        along_x(NORTH_M, CORRIDOR.x, &doors),
        along_x(SOUTH_M, CORRIDOR.x, &doors),
        along_y(NORTH_DIVIDE_M, NORTH_Y, &[6.9]),
        along_y(SOUTH_DIVIDE_M, SOUTH_Y, &[2.1]),
    ]
    .concat()
}

/// A wall along x at `y`, with doors centered at `doors`.
fn along_x(y: f64, x: (f64, f64), doors: &[f64]) -> Vec<Shape> {
    let piece = |(from, to): (f64, f64), (low, high): (f64, f64)| {
        Shape::cuboid([(from + to) / 2.0, y, low], [to - from, WALL_M, high - low])
    };
    wall(x, doors, piece)
}

/// A wall along y at `x`, with doors centered at `doors`.
fn along_y(x: f64, y: (f64, f64), doors: &[f64]) -> Vec<Shape> {
    let piece = |(from, to): (f64, f64), (low, high): (f64, f64)| {
        Shape::cuboid([x, (from + to) / 2.0, low], [WALL_M, to - from, high - low])
    };
    wall(y, doors, piece)
}

/// The pieces of a wall: beside its doors from floor to ceiling, above them the lintels.
fn wall(
    (start, end): (f64, f64),
    doors: &[f64],
    piece: impl Fn((f64, f64), (f64, f64)) -> Shape,
) -> Vec<Shape> {
    let mut pieces = Vec::new();
    let mut from = start;
    for door in doors {
        let opening = (door - DOOR_WIDTH_M / 2.0, door + DOOR_WIDTH_M / 2.0);
        pieces.push(piece((from, opening.0), (0.0, CEILING_M)));
        pieces.push(piece(opening, (DOOR_HEIGHT_M, CEILING_M)));
        from = opening.1;
    }
    pieces.push(piece((from, end), (0.0, CEILING_M)));
    pieces
}

/// The pilasters of the corridor. Without them it would look the same from every position along it, and no alignment
/// could tell these apart.
fn pilasters() -> Vec<Shape> {
    let pilaster = |x: f64, y: f64| Shape::cuboid([x, y, 0.0], [0.3, 0.16, CEILING_M]);
    let north = [0.9, 4.4, 8.1, 12.7].map(|x| pilaster(x, CORRIDOR.y.1 - 0.08));
    let south = [1.2, 5.3, 6.9, 9.2, 13.1].map(|x| pilaster(x, CORRIDOR.y.0 + 0.08));
    [north.as_slice(), south.as_slice()].concat()
}

fn hanging_lamps() -> impl Iterator<Item = Object> {
    let places =
        [(1.7, 7.6), (5.2, 6.6), (8.6, 7.8), (12.4, 7.1), (3.4, 4.6), (9.8, 4.6), (4.1, 1.3), (11.6, 1.6)];
    places.into_iter().map(|(x, y)| {
        let rod = Shape::cylinder([x, y, 2.35], 0.015, CEILING_M - 2.35);
        Object::new(vec![rod, Shape::sphere([x, y, 2.25], 0.15)])
    })
}
