//! `CustomMsg` of Livox's drivers.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// A cloud of a Livox lidar.
#[derive(Debug, Clone, PartialEq)]
pub struct LivoxCloud<'a> {
    /// When, and in which frame.
    pub header: Header<'a>,
    /// From where the points' times count, nanoseconds by the sensor's clock.
    pub timebase_ns: u64,
    /// The points.
    pub points: Vec<LivoxPoint>,
}

/// A point of a Livox lidar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LivoxPoint {
    /// When it was measured, nanoseconds after the time base.
    pub offset_ns: u32,
    /// Where, in the sensor frame, meters.
    pub xyz: [f32; 3],
    /// Which of the lasers.
    pub line: u8,
}

/// Least bytes of a point: the next one begins at a multiple of four.
const POINT_BYTES: usize = 19;

impl<'a> LivoxCloud<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// When it is cut off, or no CDR.
    pub fn read(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        let timebase_ns = cursor.u64()?;
        // The number of points, which the list says again; the lidar's number; three bytes of nothing.
        cursor.u32()?;
        cursor.bytes(4)?;
        let count = cursor.count(POINT_BYTES)?;
        let mut point = || {
            let offset_ns = cursor.u32()?;
            let xyz = [cursor.f32()?, cursor.f32()?, cursor.f32()?];
            // Reflectivity and a tag come before the line.
            cursor.bytes(2)?;
            Ok(LivoxPoint { offset_ns, xyz, line: cursor.u8()? })
        };
        let points = (0..count).map(|_| point()).collect::<Result<_, CdrError>>()?;
        Ok(Self { header, timebase_ns, points })
    }
}
