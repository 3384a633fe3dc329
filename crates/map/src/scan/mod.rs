//! Scans: point clouds and trajectories in files.
//!
//! A scan is a `Vec<Point>` in its sensor's frame, meters; a point with a NaN or infinite coordinate means "no
//! return", as does one at exactly 0 0 0, and readers and sensors alike keep it.

mod intrinsics;
mod kitti;
mod point_filter;
mod reader;
mod skipped;
mod tum;
mod unit;
mod uos_pose;
mod writer;

pub use intrinsics::{Intrinsics, IntrinsicsError};
pub use point_filter::{PointFilter, PointFilterError};
pub use reader::{ArrayHeader, ArrayHeaderError, Columns, ColumnsError, ReadError};
pub use reader::{
    compare_names, parse_points, read_exact_points, read_exact_points_by, read_points, scan_files,
    scan_files_of,
};
pub use skipped::SkippedPoints;
pub use tum::{PoseForm, StampedPose, parse_trajectory, read_poses, read_trajectory, write_trajectory};
pub use unit::UnitDoubt;
pub use uos_pose::read_uos_pose;
pub use writer::{write_f32, write_pcd, write_ply};
