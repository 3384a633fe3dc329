//! What is recorded of a map, whatever the file.

use std::io;

use crate::file_kind::LackingFeature;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::RobotName;
use mrol_map::planning::Grid;

/// A map as messages of ROS 2 in a file, all of it in the frame `map`.
///
/// Voxels (`sensor_msgs/PointCloud2`), grid (`nav_msgs/OccupancyGrid`) and ways (`nav_msgs/Path`) stand at its begin,
/// so that a viewer has them wherever it is; the robots' frames (`tf2_msgs/TFMessage`) have the times of the scans.
pub trait Recorder {
    /// Writes the centers of occupied voxels, in the map frame.
    ///
    /// # Errors
    /// When the file cannot be written.
    fn write_voxels(&mut self, centers: &[Point]) -> Result<(), RecordingError>;

    /// Writes the map from above.
    ///
    /// # Errors
    /// When the file cannot be written.
    fn write_grid(&mut self, grid: &Grid) -> Result<(), RecordingError>;

    /// Writes the way of a robot, and its frame, named as the robot, at each pose.
    ///
    /// # Errors
    /// When the file cannot be written.
    fn write_way(&mut self, robot: &RobotName, poses: &[RecordedPose]) -> Result<(), RecordingError>;

    /// Writes what is left, and the index.
    ///
    /// # Errors
    /// When the file cannot be written.
    fn finish(self: Box<Self>) -> Result<(), RecordingError>;
}

/// A pose of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedPose {
    /// When it was there, nanoseconds since the Unix epoch.
    pub stamp_ns: u64,
    /// Where it was.
    pub map_from_sensor: Pose,
}

/// Why a recording cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// This program writes none.
    #[error(transparent)]
    Lacking(#[from] LackingFeature),
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// What is to be written cannot be in such a file; the payload says why.
    #[error("the recording cannot be written: {0}")]
    Format(String),
}
