//! `mrol map`: builds a map of scans in this process, without a server.

pub mod ample;
mod command;
pub mod mapper;
mod report;
pub mod truth_errors;

pub(crate) use command::Map;
