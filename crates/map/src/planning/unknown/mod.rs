//! What is known of space: free, occupied or unknown, and what of that counts for a question.

mod classify;
mod free_space;
mod obstacles;
mod surroundings;

pub use classify::{OutOfRange, PointState, PointStates, classify_points};
pub(super) use free_space::{ALL, CELLS, FreeSpace};
pub(super) use obstacles::{Obstacles, SeenBlocks};
pub use surroundings::{Surroundings, Unknown};
