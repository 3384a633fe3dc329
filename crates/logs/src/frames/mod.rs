//! Frames: the tree of transforms, and tracks of poses over time.

mod contradiction;
mod error;
mod track;
mod tree;

pub use contradiction::Contradiction;
pub use error::{BadTransform, NoTransform, Seconds};
pub use track::{EXTRAPOLATION_MAX_NS, Outside, Track};
pub use tree::{DEPTH_MAX, FRAMES_MAX, FrameTree, NAME_BYTES_MAX};
