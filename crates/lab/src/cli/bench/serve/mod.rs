//! `mrol-lab bench serve`: puts a load of point queries on a server.

mod command;
mod protocol;
mod report;

pub(super) use command::Serve;
