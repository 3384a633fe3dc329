//! The process that replicas and bodies belong to.

use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::failure::Failure;

/// The process that made the first replica or body; 0 before.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// Makes this the process that owns everything, where none does.
pub(crate) fn claim() -> Result<(), Failure> {
    let _ = OWNER.compare_exchange(0, process::id(), Ordering::Relaxed, Ordering::Relaxed);
    check()
}

/// Refuses in a child that was forked: locks may be held by threads that are not there, and nothing may be touched.
pub(crate) fn check() -> Result<(), Failure> {
    let owner = OWNER.load(Ordering::Relaxed);
    if owner == 0 || owner == process::id() { Ok(()) } else { Err(Failure::forked()) }
}
