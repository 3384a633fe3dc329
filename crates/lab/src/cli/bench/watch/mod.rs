//! `mrol-lab bench watch`: measures what it costs that a map is followed, and whether all who follow have the same.

mod command;
mod report;
mod stage;

pub(super) use command::WatchBench;
