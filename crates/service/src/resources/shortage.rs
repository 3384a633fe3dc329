//! Too little disk or memory, and what is said to whoever wants more of it.

use std::fmt::{self, Display};
use std::time::Duration;

use crate::error::{Reason, ServiceError};

/// When to come again: whoever makes room takes longer than the next look.
pub(super) const RETRY_AFTER: Duration = Duration::from_secs(5);

/// What there is too little of: the value that was measured last, and the marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shortage {
    /// Free space on the disk of the data folder.
    Disk {
        /// Bytes that are free.
        free: u64,
        /// Fewer are too few.
        low: u64,
        /// Free bytes that are enough again.
        back: u64,
    },
    /// Memory of the process.
    Memory {
        /// Bytes in use, with those that are reserved.
        in_use: u64,
        /// More are too many.
        high: u64,
        /// At most that many are well again.
        back: u64,
    },
}

impl Shortage {
    /// The reason of refusals for it.
    pub fn reason(&self) -> Reason {
        match self {
            Self::Disk { .. } => Reason::DiskFull,
            Self::Memory { .. } => Reason::MemoryFull,
        }
    }

    pub(super) fn refusal(&self, what_else: &str) -> ServiceError {
        let message = format!("{self}{what_else}");
        ServiceError::new(self.reason(), message).retry_after(RETRY_AFTER)
    }
}

impl Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = |bytes: &u64| bytes >> 20;
        match self {
            Self::Disk { free, low, back } => write!(
                f,
                "the disk of the data folder has {} MiB free: below limits.disk_free_low_mib, {}, changes are refused \
                 until limits.disk_free_resume_mib, {}, are free again; make room there, or delete a map",
                mib(free),
                mib(low),
                mib(back)
            ),
            Self::Memory { in_use, high, back } => write!(
                f,
                "the server has {} MiB in memory or on their way there: above limits.memory_high_mib, {}, what makes maps grow is refused \
                 until it has limits.memory_resume_mib, {}, or less; delete a map, or give the server more memory",
                mib(in_use),
                mib(high),
                mib(back)
            ),
        }
    }
}
