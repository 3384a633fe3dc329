//! Placement of the furniture: drawn at random, and rejected where it would block a robot or another piece.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::building::{ARCHIVE, CORRIDOR, LOUNGE, Room, STUDY, WORKSHOP};
use super::furniture::Kind;
use super::object::Object;
use crate::route::{CAMERA_ROUTE, LIDAR_ROUTE, Route};

/// Least distance of furniture from the robots' routes, meters.
const ROUTE_CLEARANCE_M: f64 = 0.4;
/// Distance between the positions of a route that are checked, meters.
const ROUTE_SPACING_M: f64 = 0.1;
/// Least distance of pieces from each other and from walls, meters.
const GAP_M: f64 = 0.04;
/// Number of draws before a piece is left out.
const DRAWS_MAX: usize = 400;

/// The pieces of each room, the large ones first: they find room only while it is empty.
const FURNITURE: [(Room, &[Kind]); 5] = {
    use Kind::*;
    [
        (STUDY, &[Table, Table, Shelf, Shelf, Cupboard, Column, Crates, Chair, Chair, Plant, Lamp, Ball]),
        (LOUNGE, &[Sofa, Table, Shelf, Cupboard, Crates, Column, Chair, Chair, Plant, Plant, Lamp, Ball]),
        (WORKSHOP, &[Table, Table, Shelf, Cupboard, Crates, Crates, Column, Chair, Chair, Lamp, Ball]),
        (
            ARCHIVE,
            &[Shelf, Shelf, Shelf, Table, Cupboard, Crates, Crates, Column, Column, Chair, Plant, Ball],
        ),
        (CORRIDOR, &[Sideboard, Sideboard, Sideboard, Shelf, Ball, Ball]),
    ]
};

/// The furniture of every room; the same `seed` gives the same.
pub(super) fn furniture(seed: u64) -> Vec<Object> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let route = route_places();
    let mut placed: Vec<Object> = Vec::new();
    for (room, kinds) in FURNITURE {
        for kind in kinds {
            let piece = kind.build(&mut rng);
            placed.extend(place(*kind, &piece, room, &route, &placed, &mut rng));
        }
    }
    placed
}

/// Places `piece` at a free position of `room`; none when no draw finds one.
fn place(
    kind: Kind,
    piece: &Object,
    room: Room,
    route: &[[f64; 2]],
    others: &[Object],
    rng: &mut ChaCha8Rng,
) -> Option<Object> {
    let mut draws = (0..DRAWS_MAX).map(|_| {
        if kind.is_against_wall() { against_wall(piece, room, rng) } else { anywhere(piece, room, rng) }
    });
    draws.find(|piece| {
        is_inside(piece, room) && is_off(piece, route) && !others.iter().any(|other| overlap(piece, other))
    })
}

fn anywhere(piece: &Object, room: Room, rng: &mut ChaCha8Rng) -> Object {
    let (x, y) = (rng.random_range(room.x.0..room.x.1), rng.random_range(room.y.0..room.y.1));
    piece.placed(x, y, rng.random_range(0.0..TAU))
}

fn against_wall(piece: &Object, room: Room, rng: &mut ChaCha8Rng) -> Object {
    let from_wall = GAP_M - piece.bounds.min.y + 1e-6;
    let (x, y) = (rng.random_range(room.x.0..room.x.1), rng.random_range(room.y.0..room.y.1));
    match rng.random_range(0..4) {
        0 => piece.placed(x, room.y.0 + from_wall, 0.0),
        1 => piece.placed(x, room.y.1 - from_wall, PI),
        2 => piece.placed(room.x.0 + from_wall, y, -FRAC_PI_2),
        _ => piece.placed(room.x.1 - from_wall, y, FRAC_PI_2),
    }
}

fn is_inside(piece: &Object, room: Room) -> bool {
    let (min, max) = (piece.bounds.min, piece.bounds.max);
    let within = |from: f64, to: f64, (low, high): (f64, f64)| from >= low + GAP_M && to <= high - GAP_M;
    within(min.x, max.x, room.x) && within(min.y, max.y, room.y)
}

/// True when `piece` keeps its distance from every place of the routes, whatever its height.
fn is_off(piece: &Object, route: &[[f64; 2]]) -> bool {
    let (min, max) = (piece.bounds.min, piece.bounds.max);
    let outside = |c: f64, low: f64, high: f64| (low - c).max(c - high).max(0.0);
    route.iter().all(|[x, y]| outside(*x, min.x, max.x).hypot(outside(*y, min.y, max.y)) >= ROUTE_CLEARANCE_M)
}

/// True when the footprints' bounds come closer than the gap.
fn overlap(a: &Object, b: &Object) -> bool {
    let axis =
        |i: usize| a.bounds.min[i] < b.bounds.max[i] + GAP_M && b.bounds.min[i] < a.bounds.max[i] + GAP_M;
    axis(0) && axis(1)
}

fn route_places() -> Vec<[f64; 2]> {
    let places = |route: &Route| {
        let count = (route.length_m() / ROUTE_SPACING_M).ceil() as usize;
        (0..count).map(|i| route.position(i as f64 * ROUTE_SPACING_M)).collect::<Vec<_>>()
    };
    [places(&LIDAR_ROUTE), places(&CAMERA_ROUTE)].concat()
}
