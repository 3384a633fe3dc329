//! Measurements behind `mrol-lab bench`: each operation by itself, repeatedly, with one clock.

pub mod align;
pub mod growth;
pub mod insert;
pub mod journal;
pub mod lookup;
pub mod memory;
pub mod nearest;
pub mod peer_file;
pub mod planning;
pub mod rays;
pub mod readers;
pub mod replica;
pub mod start;
pub mod stopwatch;
