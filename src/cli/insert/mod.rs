//! `mrol insert`: sends scans to a map of a server.

mod attempts;
mod command;
#[cfg(feature = "logs")]
mod from_log;
#[cfg(feature = "logs")]
mod pace;
mod plan;
mod report;
mod sending;

pub(super) use command::Insert;
