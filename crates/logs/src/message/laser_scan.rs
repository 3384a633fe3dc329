//! `sensor_msgs/LaserScan`.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// A scan in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserScan<'a> {
    /// When its first ray was measured, and in which frame: x ahead, y to the left.
    pub header: Header<'a>,
    /// Angle of the first ray, radians, counterclockwise from x.
    pub angle_min_rad: f32,
    /// From one ray to the next, radians.
    pub angle_increment_rad: f32,
    /// From one ray to the next, seconds; 0 where nobody says.
    pub time_increment_s: f32,
    /// Ranges below it are none, meters.
    pub range_min_m: f32,
    /// Ranges above it are none, meters.
    pub range_max_m: f32,
    /// One for each ray, meters.
    pub ranges_m: Vec<f32>,
}

impl<'a> LaserScan<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// When it is cut off, or no CDR.
    pub fn read(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        let [angle_min_rad, _, angle_increment_rad, time_increment_s, _, range_min_m, range_max_m] = {
            let mut numbers = [0.0; 7];
            for number in &mut numbers {
                *number = cursor.f32()?;
            }
            numbers
        };
        let count = cursor.count(size_of::<f32>())?;
        let ranges_m = (0..count).map(|_| cursor.f32()).collect::<Result<_, _>>()?;
        Ok(Self {
            header,
            angle_min_rad,
            angle_increment_rad,
            time_increment_s,
            range_min_m,
            range_max_m,
            ranges_m,
        })
    }
}
