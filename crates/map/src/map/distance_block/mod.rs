//! How far the cells of a box are from what is occupied: an exact Euclidean distance transform.
//!
//! The distance is that from a cell's center to the nearest occupied *cube* of the level: along an axis on which the
//! two are `d` cells apart it is `max(0, d - 1/2)` cells. Twice that is a whole number, and so is four times the square
//! of a distance: all of this is done in integers, and comes out the same on every machine.
//!
//! ```text
//! layer      in each row along x, the square of the distance to the nearest occupied cell of the row
//! transform  along y, the least over the rows of the same z of that and the square of the way to the row;
//!            along z, the same over the rows of the same y. The root of it is the distance
//! ```
//!
//! As all is capped, no row farther than [`margin_of`] the cap counts, and a row without anything near is skipped.

mod block;
mod cap;
mod layer;
mod rows;
mod transform;

pub use block::DistanceBlock;
pub use cap::{DISTANCE_CAP_MAX, margin_of};
