//! Measurements behind `mrol bench`: each operation by itself, repeatedly, with one clock.

pub mod align;
pub mod growth;
pub mod insert;
pub mod journal;
pub mod lookup;
pub mod planning;
pub mod readers;
pub mod start;
pub mod stopwatch;
