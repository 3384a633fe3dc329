//! Files of other mapping programs: maps, read and written, and scans.
//!
//! ```text
//! file_kind        which program a file is of, by its extension
//! octree           OctoMap's .bt and .ot
//! npz              arrays of numpy
//! survey           LAS, LAZ and E57, with the feature `surveys`
//! mapped_points    points to the voxels and moments of a map, part by part
//!   collected_voxels   voxels that come one by one          counted   a file, with the place where reading stands
//!   regular_file       a file that has an end
//! depth_image      a scan of a depth camera, as PNG
//! recording        a map as a log, which viewers of logs show
//! ```
//!
//! Everything here reads what others wrote. Counts are compared with the bytes that are there before anything is
//! allocated by them, and trees are walked to a fixed depth.

mod collected_voxels;
mod counted;
mod depth_image;
mod file_kind;
mod mapped_points;
pub mod npz;
pub mod octree;
mod recording;
mod regular_file;
pub mod survey;

pub use depth_image::{DepthImageError, DepthImages};
pub use file_kind::{FileKind, LackingFeature};
pub use mapped_points::MappedPoints;
pub use recording::{RecordedPose, Recorder, RecordingError, begin_recording};
pub use regular_file::open_regular;
