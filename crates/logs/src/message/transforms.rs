//! `tf2_msgs/TFMessage`.

use super::header::{Header, plain_frame};
use crate::cdr::{CdrError, Cursor};
use mrol_map::geometry::{Pose, pose};

/// Where one frame is in another at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedTransform<'a> {
    /// When, and the parent.
    pub header: Header<'a>,
    /// The child.
    pub child_frame: &'a str,
    /// parent_from_child; none where its numbers are no pose.
    pub parent_from_child: Option<Pose>,
}

/// Least bytes of a transform: a time, two strings, seven numbers.
const TRANSFORM_BYTES: usize = 8 + 4 + 4 + 7 * 8;

/// The transforms of a message. Their frames have names of any length: a bad one spoils no other transform.
///
/// # Errors
/// When it is cut off, or no CDR.
pub fn transforms(message: &[u8]) -> Result<Vec<StampedTransform<'_>>, CdrError> {
    let mut cursor = Cursor::new(message)?;
    let count = cursor.count(TRANSFORM_BYTES)?;
    let mut transform = || {
        let header = Header::read_of_any_frame(&mut cursor)?;
        let child_frame = plain_frame(cursor.string()?);
        let parent_from_child = pose_of(&mut cursor)?;
        Ok(StampedTransform { header, child_frame, parent_from_child })
    };
    (0..count).map(|_| transform()).collect()
}

/// A translation and a quaternion x y z w; none where the numbers are no pose. Programs round quaternions, so that they
/// are normalized whatever their length, but for 0.
pub(super) fn pose_of(cursor: &mut Cursor<'_>) -> Result<Option<Pose>, CdrError> {
    let translation = cursor.f64s::<3>()?;
    let rotation = cursor.f64s::<4>()?;
    let length = rotation.iter().map(|c| c * c).sum::<f64>().sqrt();
    Ok((0.5..2.0).contains(&length).then(|| pose(translation, rotation.map(|c| c / length)).ok()).flatten())
}
