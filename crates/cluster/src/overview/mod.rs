//! The cluster as it is seen by whoever is no node of it, from the beats of the nodes and the list of maps.
//!
//! Reading order: `seen` is what is seen; `reader` looks again and again.

mod reader;
mod seen;

pub use reader::{OverviewError, OverviewReader};
pub use seen::{MapCopy, Overview, SeenMap, SeenNode};
