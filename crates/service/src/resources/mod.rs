//! Disk and memory: how much there is, how much of it is reserved, and how much a change takes.

mod budget;
mod gauges;
mod growth;
mod shortage;
mod watermarks;

pub(crate) use budget::{Reservation, ResourceBudget};
pub use gauges::{Gauges, MemoryReading, Readings};
pub(crate) use growth::{BLOCK_BYTES, growth_bytes, removal_bytes};
pub use shortage::Shortage;
