//! The messages of a log, one by one, whatever its format.

use super::error::{Damage, LogError};
use super::message::{LogMessage, Topic};

/// The messages of a log, one by one, in the order in which they were recorded.
pub trait Messages {
    /// Goes to the next message: the number of its topic, and when it was recorded, nanoseconds. None at the end, and
    /// where the log is [damaged](Messages::damages).
    ///
    /// # Errors
    /// When the file cannot be read.
    fn advance(&mut self) -> Result<Option<(usize, u64)>, LogError>;

    /// The bytes of the message that [`Messages::advance`] went to.
    fn data(&self) -> &[u8];

    /// The topics that were met so far, in the order in which they were met; their numbers stay.
    fn topics(&self) -> &[Topic];

    /// Bytes of the file that were read, or about so many.
    fn position(&self) -> u64;

    /// Where and why files were not read to their end, once there is no further message of them.
    fn damages(&self) -> &[Damage];

    /// The next message; none at the end, and where the log is [damaged](Messages::damages).
    ///
    /// # Errors
    /// When the file cannot be read.
    fn next_message(&mut self) -> Result<Option<LogMessage<'_>>, LogError> {
        let Some((topic, log_time_ns)) = self.advance()? else { return Ok(None) };
        Ok(Some(LogMessage { topic, log_time_ns, data: self.data() }))
    }
}
