//! `mrol map`: builds a map of scans in this process, without a server.

mod command;
#[cfg(feature = "logs")]
mod from_log;
mod report;
mod run;

pub(crate) use command::Map;
