//! What disk and memory are measured with.

use std::fmt::Debug;

/// Tells how full disk and memory are.
pub trait Gauges: Debug + Send + Sync {
    /// Bytes that are free on the disk of the data folder, where that is known. May block: not for an async thread.
    fn disk_free_bytes(&self) -> Option<u64>;

    /// The memory of the process, where that is known. Does not wait for a disk: it is asked before every scan.
    fn memory(&self) -> Option<MemoryReading>;
}

/// What the gauges said at one look; nothing of a gauge that cannot be read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Readings {
    /// Bytes that are free on the disk of the data folder.
    pub disk_free_bytes: Option<u64>,
    /// The memory of the process.
    pub memory: Option<MemoryReading>,
}

/// The memory of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryReading {
    /// Bytes that it has in memory.
    pub resident_bytes: u64,
    /// Bytes that the system, or the control group of the process, has in all.
    pub allowed_bytes: u64,
}
