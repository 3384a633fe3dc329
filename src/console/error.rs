//! Errors of a command, and their exit codes.

use std::fmt;
use std::fmt::Display;
use std::io;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

use crate::server::ServerError;
use mrol_client::ClientError;
use mrol_map::scan::ReadError;
use mrol_service::Reason;
use mrol_store::StoreError;

/// A command that did not succeed.
#[derive(Debug)]
pub enum CliError {
    /// The command line is not valid: exit code 2.
    Usage(String),
    /// The command failed: exit code 1.
    Failed(String),
    /// Every scan was answered, and at least one was not accepted: exit code 3.
    NotAccepted(String),
    /// Standard output was closed (`mrol ... | head`): no failure, and nothing to report.
    OutputClosed,
}

impl CliError {
    /// The command line makes no sense, for the reason of `message`.
    pub fn usage(message: impl Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// The command failed, for the reason of `message`.
    pub fn failed(message: impl Display) -> Self {
        Self::Failed(message.to_string())
    }

    /// `refused` of `scans` scans were answered with a verdict other than `accepted`; success where none was.
    pub fn unless_accepted(refused: usize, scans: usize) -> Result<(), Self> {
        match refused {
            0 => Ok(()),
            _ => Err(Self::NotAccepted(format!("{refused} of {scans} scans not accepted"))),
        }
    }

    /// The error of a file that cannot be written.
    pub fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::Failed(format!("{}: cannot be written: {error}", path.display()))
    }

    /// The error of standard output that cannot be written.
    pub fn printing(error: io::Error) -> Self {
        match error.kind() {
            ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::Failed(format!("standard output cannot be written: {error}")),
        }
    }

    /// Writes the error to standard error and returns the exit code of the process.
    pub fn report(self) -> ExitCode {
        let code = match self {
            Self::Usage(_) => 2,
            Self::Failed(_) => 1,
            Self::NotAccepted(_) => 3,
            Self::OutputClosed => return ExitCode::SUCCESS,
        };
        // Where standard error is closed too, the exit code says it all.
        let _ = writeln!(io::stderr(), "error: {self}");
        ExitCode::from(code)
    }
}

impl Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(message) | Self::Failed(message) | Self::NotAccepted(message) => f.write_str(message),
            Self::OutputClosed => f.write_str("nobody reads the output any more"),
        }
    }
}

impl From<ClientError> for CliError {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Url { .. } | ClientError::Credentials(_) => Self::usage(error),
            _ if error.reason() == Some(Reason::KeyMissing.as_str()) => Self::failed(format!(
                "{error}; --key-file FILE or MROL_KEY_FILE names a file with the secret of one"
            )),
            _ => Self::failed(error),
        }
    }
}

impl From<ReadError> for CliError {
    fn from(error: ReadError) -> Self {
        Self::failed(error)
    }
}

impl From<StoreError> for CliError {
    fn from(error: StoreError) -> Self {
        Self::failed(error)
    }
}

impl From<ServerError> for CliError {
    fn from(error: ServerError) -> Self {
        match &error {
            ServerError::Listen { protocol, error: cause, .. } if cause.kind() == ErrorKind::AddrInUse => {
                Self::failed(format!(
                    "{error}: stop whoever listens there, or choose another address with --{protocol}-listen"
                ))
            }
            _ => Self::failed(error),
        }
    }
}
