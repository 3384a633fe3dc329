//! `mrol insert`: sends scans to a map of a server.

mod attempts;
mod command;
mod plan;
mod report;
mod sending;

pub(super) use command::Insert;
