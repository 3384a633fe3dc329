//! `mrol map`: builds a map of scans in this process, without a server.

mod command;
mod report;

pub(crate) use command::Map;
