//! Logs of robots: `mrol log` says what one has, and the commands that take scans read them from one.

mod command;
mod file;
mod options;
mod report;

pub(super) use command::Log;
pub(super) use file::{LogFile, LogScans, name_of_stamp};
pub(super) use options::LogOptions;
