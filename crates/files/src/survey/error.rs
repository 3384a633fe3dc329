//! Why a survey cannot be read or written.

use std::io;

use crate::file_kind::LackingFeature;

/// Why a survey cannot be read or written; whoever has the file's name puts it before the message.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// The file cannot be read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The content is not what its format asks for.
    #[error("{0}")]
    Content(String),
    /// A header claims more than the file has.
    #[error("{what}, and the file has {have}: it was cut off or is damaged")]
    Claim {
        /// What is claimed.
        what: String,
        /// What is there.
        have: String,
    },
    /// This program was built without what reads and writes surveys.
    #[error(transparent)]
    Lacking(#[from] LackingFeature),
    /// The survey cannot be written.
    #[error("{0}")]
    Writing(String),
}

#[cfg(feature = "surveys")]
impl SurveyError {
    /// A claim of `what`, which `length` bytes cannot have.
    pub(super) fn claim(what: impl Into<String>, length: u64) -> Self {
        Self::Claim { what: what.into(), have: format!("{length} bytes") }
    }
}

#[cfg(feature = "surveys")]
impl From<las::Error> for SurveyError {
    fn from(error: las::Error) -> Self {
        match error {
            las::Error::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                Self::Content("the file ends before its last point: it was cut off or is damaged".to_owned())
            }
            las::Error::Io(error) => Self::Io(error),
            las::Error::LasZipError(error) => Self::Content(format!(
                "its compressed points cannot be read ({error}): it was cut off or is damaged"
            )),
            error => Self::Content(format!("no LAS that can be read: {error}")),
        }
    }
}

#[cfg(feature = "surveys")]
impl From<e57::Error> for SurveyError {
    fn from(error: e57::Error) -> Self {
        Self::Content(format!("no E57 that can be read: {error}"))
    }
}
