//! Pieces of furniture, built of shapes about the origin: x to the right, the back towards -y, the floor at z = 0.
//!
//! Lengths are meters.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::building::CEILING_M;
use super::object::Object;
use super::shape::Shape;

/// Kinds of furniture.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Table,
    Chair,
    Shelf,
    Cupboard,
    /// A sideboard, shallow enough for the corridor.
    Sideboard,
    Sofa,
    Column,
    Plant,
    Lamp,
    Ball,
    Crates,
}

impl Kind {
    /// True for a piece that stands with its back to a wall.
    pub(super) fn is_against_wall(self) -> bool {
        matches!(self, Self::Shelf | Self::Cupboard | Self::Sideboard | Self::Sofa)
    }

    /// Builds a piece of this kind, with sizes drawn from `rng`.
    pub(super) fn build(self, rng: &mut ChaCha8Rng) -> Object {
        Object::new(match self {
            Self::Table => table(rng),
            Self::Chair => chair(),
            Self::Shelf => shelf(rng),
            Self::Cupboard => cupboard(rng),
            Self::Sideboard => sideboard(rng),
            Self::Sofa => sofa(),
            Self::Column => vec![Shape::cylinder([0.0; 3], rng.random_range(0.12..0.2), CEILING_M)],
            Self::Plant => plant(rng),
            Self::Lamp => lamp(),
            Self::Ball => ball(rng.random_range(0.18..0.3)),
            Self::Crates => crates(rng),
        })
    }
}

/// Four legs of `side` and `height` under the corners of `width` x `depth`.
fn legs(width: f64, depth: f64, height: f64, side: f64) -> impl Iterator<Item = Shape> {
    let (x, y) = ((width - side) / 2.0, (depth - side) / 2.0);
    let leg = move |(x, y)| Shape::cuboid([x, y, 0.0], [side, side, height]);
    [(-x, -y), (x, -y), (-x, y), (x, y)].into_iter().map(leg)
}

/// A table with a screen turned a little and a vase on it.
fn table(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    let (width, depth, height, top) = (rng.random_range(1.0..1.5), rng.random_range(0.6..0.75), 0.72, 0.04);
    let on_top = height + top;
    let screen = Shape::cuboid([0.0, 0.0, on_top], [0.5, 0.06, 0.36]);
    let mut parts = vec![
        Shape::cuboid([0.0, 0.0, height], [width, depth, top]),
        screen.placed(-0.2 * width, 0.0, rng.random_range(-0.5..0.5)),
        Shape::cylinder([0.3 * width, rng.random_range(-0.15..0.15), on_top], 0.07, 0.25),
    ];
    parts.extend(legs(width, depth, height, 0.06));
    parts
}

fn chair() -> Vec<Shape> {
    let (side, seat) = (0.42, 0.43);
    let mut parts = vec![
        Shape::cuboid([0.0, 0.0, seat], [side, side, 0.04]),
        Shape::cuboid([0.0, -0.19, seat + 0.04], [side, 0.04, 0.45]),
    ];
    parts.extend(legs(side, side, seat, 0.04));
    parts
}

/// A shelf of five boards with books, each as wide and high as it comes.
fn shelf(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    let (width, depth, board, gap) = (rng.random_range(0.8..1.2), 0.3, 0.025, 0.42);
    let height = 4.0 * gap + board;
    let side = |x: f64| Shape::cuboid([x, 0.0, 0.0], [board, depth, height]);
    let mut parts = vec![
        side((board - width) / 2.0),
        side((width - board) / 2.0),
        Shape::cuboid([0.0, 0.01 - depth / 2.0, 0.0], [width, 0.02, height]),
    ];
    for level in (0..5).map(f64::from) {
        parts.push(Shape::cuboid([0.0, 0.0, level * gap], [width, depth, board]));
        if level < 4.0 {
            let books = [rng.random_range(0.2..0.7) * width, 0.2, rng.random_range(0.2..0.34)];
            let x = (width - 2.0 * board - books[0]) * rng.random_range(-0.5..0.5);
            parts.push(Shape::cuboid([x, -0.03, level * gap + board], books));
        }
    }
    parts
}

fn cupboard(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    let (width, depth, height) = (rng.random_range(0.7..1.1), 0.45, rng.random_range(1.2..2.0));
    let handle = |x: f64| Shape::cuboid([x, depth / 2.0 + 0.02, height * 0.5], [0.03, 0.04, 0.2]);
    vec![
        Shape::cuboid([0.0, 0.0, 0.0], [width, depth, height]),
        handle(-0.08),
        handle(0.08),
        Shape::cuboid([0.1, 0.0, height], [0.4, 0.3, 0.2]).placed(0.0, 0.0, rng.random_range(-0.4..0.4)),
    ]
}

fn sideboard(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    let (width, depth, height) = (rng.random_range(0.6..1.0), 0.28, rng.random_range(0.7..1.1));
    vec![
        Shape::cuboid([0.0, 0.0, 0.0], [width, depth, height]),
        Shape::cylinder([0.2, 0.0, height], 0.09, 0.3),
        Shape::sphere([-0.15, 0.0, height + 0.11], 0.11),
    ]
}

fn sofa() -> Vec<Shape> {
    let (width, depth) = (1.5, 0.75);
    let arm = |x: f64| Shape::cuboid([x, 0.0, 0.0], [0.16, depth, 0.6]);
    vec![
        Shape::cuboid([0.0, 0.0, 0.0], [width, depth, 0.4]),
        Shape::cuboid([0.0, 0.1 - depth / 2.0, 0.4], [width, 0.2, 0.4]),
        arm(-width / 2.0),
        arm(width / 2.0),
    ]
}

fn plant(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    let crown = rng.random_range(0.2..0.3);
    vec![
        Shape::cylinder([0.0; 3], 0.17, 0.35),
        Shape::cylinder([0.0, 0.0, 0.35], 0.03, 0.4),
        Shape::sphere([0.0, 0.0, 0.7 + crown], crown),
    ]
}

fn lamp() -> Vec<Shape> {
    vec![
        Shape::cylinder([0.0; 3], 0.16, 0.03),
        Shape::cylinder([0.0, 0.0, 0.03], 0.025, 1.5),
        Shape::sphere([0.0, 0.0, 1.6], 0.18),
    ]
}

fn ball(radius: f64) -> Vec<Shape> {
    vec![Shape::sphere([0.0, 0.0, radius], radius)]
}

/// Two crates, the upper one turned against the lower.
fn crates(rng: &mut ChaCha8Rng) -> Vec<Shape> {
    vec![
        Shape::cuboid([0.0; 3], [0.55, 0.4, 0.45]),
        Shape::cuboid([0.0, 0.0, 0.45], [0.35, 0.3, 0.35]).placed(0.0, 0.0, rng.random_range(-0.7..0.7)),
    ]
}
