//! A recording in MCAP: its topics, and what is written to them.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::definition::{Definition, OCCUPANCY_GRID, PATH, POINT_CLOUD, TRANSFORMS};
use super::message;
use super::recorder::{RecordedPose, Recorder, RecordingError};
use mrol_map::geometry::Point;
use mrol_map::map::RobotName;
use mrol_map::planning::Grid;

/// Topic of the occupied voxels.
const VOXELS: &str = "/map/voxels";
/// Topic of the map from above.
const GRID: &str = "/map/grid";
/// Topic of the robots' frames.
const TF: &str = "/tf";

/// Messages of ROS 2 in an MCAP file, compressed by zstd, which describes their types itself.
pub(super) struct McapRecorder<W: Write + Seek> {
    writer: Writer<W>,
    /// When the recording begins, nanoseconds since the Unix epoch.
    begin_ns: u64,
    /// Channels by topic.
    channels: BTreeMap<String, u16>,
    messages: u32,
}

impl From<McapError> for RecordingError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::Io(error) => Self::Io(error),
            error => Self::Format(error.to_string()),
        }
    }
}

impl<W: Write + Seek> McapRecorder<W> {
    /// A recording without a message.
    pub(super) fn begin(file: W, begin_ns: u64) -> Result<Self, RecordingError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("mrol ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd));
        Ok(Self { writer: options.create(file)?, begin_ns, channels: BTreeMap::new(), messages: 0 })
    }

    fn write(
        &mut self,
        topic: &str,
        definition: &Definition,
        time_ns: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let channel_id = self.channel(topic, definition)?;
        let header =
            MessageHeader { channel_id, sequence: self.messages, log_time: time_ns, publish_time: time_ns };
        self.messages = self.messages.wrapping_add(1);
        Ok(self.writer.write_to_known_channel(&header, data)?)
    }

    fn channel(&mut self, topic: &str, definition: &Definition) -> Result<u16, RecordingError> {
        if let Some(&channel) = self.channels.get(topic) {
            return Ok(channel);
        }
        let schema = self.writer.add_schema(definition.name, "ros2msg", definition.text().as_bytes())?;
        let channel = self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }
}

impl<W: Write + Seek> Recorder for McapRecorder<W> {
    fn write_voxels(&mut self, centers: &[Point]) -> Result<(), RecordingError> {
        let begin_ns = self.begin_ns;
        self.write(VOXELS, &POINT_CLOUD, begin_ns, &message::point_cloud(begin_ns, centers))
    }

    fn write_grid(&mut self, grid: &Grid) -> Result<(), RecordingError> {
        let begin_ns = self.begin_ns;
        self.write(GRID, &OCCUPANCY_GRID, begin_ns, &message::occupancy_grid(begin_ns, grid))
    }

    fn write_way(&mut self, robot: &RobotName, poses: &[RecordedPose]) -> Result<(), RecordingError> {
        let begin_ns = self.begin_ns;
        let topic = format!("/robots/{robot}/path");
        self.write(&topic, &PATH, begin_ns, &message::path(begin_ns, poses))?;
        for pose in poses {
            let data = message::transform(robot.as_str(), pose);
            self.write(TF, &TRANSFORMS, pose.stamp_ns, &data)?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), RecordingError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().flush()?)
    }
}
