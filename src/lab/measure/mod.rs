//! What `mrol bench` measures: each operation by itself, again and again, by one clock.

pub mod align;
pub mod growth;
pub mod insert;
pub mod journal;
pub mod lookup;
pub mod readers;
pub mod start;
pub mod stopwatch;
