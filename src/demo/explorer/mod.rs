//! An explorer: a simulated robot that nobody steers maps a building by itself, with what the server answers planners.
//!
//! It goes to the nearest frontier, over and over, on ways on which its body meets nothing, where what no scan saw
//! through counts as occupied. Its steps are those of any explorer: a scan; where does the body fit; which frontiers
//! are there; the shortest way to the nearest; is the whole motion free.

mod frontier_explorer;
mod goal;
mod standing;
mod step;
mod visible;
mod ways;

pub(crate) use frontier_explorer::Explorer;
pub(crate) use step::Step;
pub(super) use visible::{Visible, never_collided};
