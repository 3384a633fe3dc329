//! `mrol-lab bench replica`: measures a copy of a map that follows.

mod command;
mod report;

pub(super) use command::ReplicaBench;
