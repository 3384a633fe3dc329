//! `std_msgs/Header`.

use crate::cdr::{CdrError, Cursor};
use crate::frames::NAME_BYTES_MAX;

/// When and in which frame a message was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header<'a> {
    /// Nanoseconds since the Unix epoch, or of another clock.
    pub stamp_ns: i64,
    /// The frame, without the leading slash of older programs.
    pub frame: &'a str,
}

impl<'a> Header<'a> {
    /// The header at the cursor.
    ///
    /// # Errors
    /// When the message ends before its end, or the frame's name is not one of [frames](crate::frames).
    pub fn read(cursor: &mut Cursor<'a>) -> Result<Self, CdrError> {
        let header = Self::read_of_any_frame(cursor)?;
        Ok(Self { frame: bounded(header.frame)?, ..header })
    }

    /// The header at the cursor, whose frame has a name of any length.
    ///
    /// # Errors
    /// When the message ends before its end.
    pub(super) fn read_of_any_frame(cursor: &mut Cursor<'a>) -> Result<Self, CdrError> {
        let (seconds, nanoseconds) = (cursor.i32()?, cursor.u32()?);
        Ok(Self {
            // Of all numbers that fit, the sum fits too.
            stamp_ns: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
            frame: plain_frame(cursor.string()?),
        })
    }
}

/// A frame's name that is short enough to be kept, and that a terminal may be shown.
pub(super) fn bounded(frame: &str) -> Result<&str, CdrError> {
    match frame.len() {
        len if len > NAME_BYTES_MAX || frame.contains(char::is_control) => {
            Err(CdrError::FrameName { len, max: NAME_BYTES_MAX })
        }
        _ => Ok(frame),
    }
}

/// A frame's name without the leading slash of older programs.
pub(super) fn plain_frame(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}
