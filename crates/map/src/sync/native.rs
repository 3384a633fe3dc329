//! The primitives of the system.

pub use std::sync::{atomic::AtomicU64, mpsc};
pub use std::thread;

pub(super) use parking_lot::{Mutex, MutexGuard, RwLock, RwLockReadGuard, RwLockWriteGuard};
