//! `std_msgs/Header`.

use crate::cdr::{CdrError, Cursor};

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
    /// When the message ends before its end.
    pub fn read(cursor: &mut Cursor<'a>) -> Result<Self, CdrError> {
        let (seconds, nanoseconds) = (cursor.i32()?, cursor.u32()?);
        Ok(Self {
            // Of all numbers that fit, the sum fits too.
            stamp_ns: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
            frame: plain_frame(cursor.string()?),
        })
    }
}

/// A frame's name without the leading slash of older programs.
pub(super) fn plain_frame(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}
