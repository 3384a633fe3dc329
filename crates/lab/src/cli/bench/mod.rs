//! `mrol-lab bench`: benchmarks on this machine.

mod align;
mod command;
mod growth;
mod insert;
mod journal;
mod lookup;
mod memory;
mod nearest;
mod planning;
mod questions;
mod rays;
mod readers;
mod replica;
mod serve;
mod soak;
mod start;
mod watch;
pub(super) mod workload;

pub(in crate::cli) use command::Bench;
