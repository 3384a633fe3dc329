//! A recording begins, if this program writes any.

use std::fs::File;

use super::recorder::{Recorder, RecordingError};

/// A recording in a new MCAP file, which begins at a time: nanoseconds since the Unix epoch.
///
/// # Errors
/// When the file cannot be written, or this program was built without recordings.
pub fn begin_recording(file: File, begin_ns: u64) -> Result<Box<dyn Recorder>, RecordingError> {
    #[cfg(feature = "recordings")]
    {
        Ok(Box::new(super::mcap_recorder::McapRecorder::begin(std::io::BufWriter::new(file), begin_ns)?))
    }
    #[cfg(not(feature = "recordings"))]
    {
        let _ = (file, begin_ns);
        Err(crate::LackingFeature { extension: "mcap", feature: "recordings" }.into())
    }
}
