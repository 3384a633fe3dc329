//! `sensor_msgs/CameraInfo`.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// Numbers of a distortion, at most: as many as the largest model has.
const DISTORTION_MAX: usize = 14;

/// What is known of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraInfo {
    /// Rows of its images.
    pub height: u32,
    /// Pixels of a row.
    pub width: u32,
    /// What the lens does to an image (`D`): none of it where all numbers are 0.
    pub distortion: Vec<f64>,
    /// The intrinsic matrix of images that the lens distorts (`K`), row by row.
    pub intrinsics: [f64; 9],
    /// The projection matrix of images that were rectified (`P`), row by row.
    pub projection: [f64; 12],
    /// Pixels that are one, along a row and along a column; 0 is 1.
    pub binning: [u32; 2],
    /// Column and row at which images begin that are a part of what the camera sees.
    pub offset: [u32; 2],
}

impl CameraInfo {
    /// Reads a message.
    ///
    /// # Errors
    /// When it is cut off, no CDR, or its distortion has more numbers than any model.
    pub fn read(message: &[u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        Header::read(&mut cursor)?;
        let (height, width) = (cursor.u32()?, cursor.u32()?);
        // The name of the model that the numbers of the distortion are of.
        cursor.string()?;
        let count = cursor.count(size_of::<f64>())?;
        if count > DISTORTION_MAX {
            return Err(CdrError::TooMany { what: "d", count, max: DISTORTION_MAX });
        }
        let distortion = (0..count).map(|_| cursor.f64()).collect::<Result<_, _>>()?;
        let intrinsics = cursor.f64s()?;
        // The rotation to the rectified images.
        cursor.f64s::<9>()?;
        let projection = cursor.f64s()?;
        let binning = [cursor.u32()?, cursor.u32()?];
        let offset = [cursor.u32()?, cursor.u32()?];
        Ok(Self { height, width, distortion, intrinsics, projection, binning, offset })
    }
}
