//! `sensor_msgs/Imu`.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// What an accelerometer reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu<'a> {
    /// When, and in which frame.
    pub header: Header<'a>,
    /// Acceleration against free fall, m/s^2: at rest, upward and of 9.81. Some drivers write it in g.
    pub acceleration: [f64; 3],
}

impl<'a> Imu<'a> {
    /// Reads a message; none where it says that it has no acceleration.
    ///
    /// # Errors
    /// When it is cut off, or no CDR.
    pub fn read(message: &'a [u8]) -> Result<Option<Self>, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        cursor.f64s::<4>()?;
        cursor.f64s::<9>()?;
        cursor.f64s::<3>()?;
        cursor.f64s::<9>()?;
        let acceleration = cursor.f64s()?;
        let covariance = cursor.f64s::<9>()?;
        // By the definition of the message.
        Ok((covariance[0] != -1.0).then_some(Self { header, acceleration }))
    }
}
