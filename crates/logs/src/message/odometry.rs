//! `nav_msgs/Odometry`.

use super::header::{Header, bounded, plain_frame};
use super::transforms::pose_of;
use crate::cdr::{CdrError, Cursor};
use mrol_map::geometry::Pose;

/// Where a robot is by its odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry<'a> {
    /// When, and the frame in which it moves.
    pub header: Header<'a>,
    /// The frame that moves.
    pub child_frame: &'a str,
    /// Where: header.frame_from_child; none where its numbers are no pose.
    pub pose: Option<Pose>,
}

impl<'a> Odometry<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// When it is cut off, or no CDR, or a frame's name is longer than those of [frames](crate::frames).
    pub fn read(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        let child_frame = bounded(plain_frame(cursor.string()?))?;
        let pose = pose_of(&mut cursor)?;
        Ok(Self { header, child_frame, pose })
    }
}
