//! Workloads: content for maps, and queries about it. Both are seeded and made in pieces, so that 50 million voxels
//! need no list of their keys.

pub(crate) mod bodies;
mod content;
mod queries;
mod ride;
mod room;
mod scatter;
mod sequence;
mod shots;
mod site;

pub use content::{Workload, add};
pub use queries::{Order, Queries};
pub use room::Room;
pub use scatter::Scatter;
pub use sequence::{Scan, simulate};
pub use shots::{ShotLayout, Shots};
pub use site::Site;
