//! `sensor_msgs/Image`.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// An image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Image<'a> {
    /// When it was taken, and in which frame: z ahead, x to the right, y down.
    pub header: Header<'a>,
    /// Rows.
    pub height: u32,
    /// Pixels of a row.
    pub width: u32,
    /// What a pixel is, such as `16UC1`.
    pub encoding: &'a str,
    /// True where numbers have their highest byte first.
    pub is_big_endian: bool,
    /// Bytes from one row to the next.
    pub step: u32,
    /// The rows, one after another.
    pub data: &'a [u8],
}

impl<'a> Image<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// When it is cut off, or no CDR.
    pub fn read(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        let (height, width, encoding) = (cursor.u32()?, cursor.u32()?, cursor.string()?);
        let (is_big_endian, step) = (cursor.u8()? != 0, cursor.u32()?);
        let count = cursor.count(1)?;
        Ok(Self { header, height, width, encoding, is_big_endian, step, data: cursor.bytes(count)? })
    }
}
