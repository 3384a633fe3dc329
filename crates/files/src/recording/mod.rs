//! Recordings: a map as messages of ROS 2 in an MCAP file, which Foxglove and other viewers of logs show.
//!
//! ```text
//! begin            a recording begins               recorder     what is recorded
//! mcap_recorder    the topics, and what is written to them
//!   message          the bytes of each message       definition   what fields the messages have
//!   cdr              numbers and texts in CDR
//! ```

mod begin;
#[cfg(feature = "recordings")]
mod cdr;
#[cfg(feature = "recordings")]
mod definition;
#[cfg(feature = "recordings")]
mod mcap_recorder;
#[cfg(feature = "recordings")]
mod message;
mod recorder;
#[cfg(feature = "recordings")]
#[cfg(test)]
mod tests;

pub use begin::begin_recording;
pub use recorder::{RecordedPose, Recorder, RecordingError};
