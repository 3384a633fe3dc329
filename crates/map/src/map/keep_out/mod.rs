//! Keep-outs: named parts of space where no robot may go, whatever the map holds there.
//!
//! Each is a change of the map with a revision of its own. They are tested as shapes and are no voxels: alignment,
//! exports and the content hash know nothing of them.

mod change;
mod keep_outs;
mod outline;
mod place;
mod points;
mod polygon;
mod prism;
mod ray;
mod shape;
#[cfg(test)]
pub(crate) mod test_shapes;
mod voxels;

pub use change::{KeepOutAct, KeepOutChange};
pub use keep_outs::{KEEP_OUTS_MAX, KeepOut, KeepOuts, KeepOutsFull};
pub use outline::Outline;
pub use prism::{PRISM_CORNERS_MAX, Prism, PrismError};
pub use ray::ShapeRay;
pub use shape::{KeepOutShape, KeepOutShapeError};
pub use voxels::TooManyVoxels;
