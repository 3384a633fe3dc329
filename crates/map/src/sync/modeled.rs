//! The primitives of the model checker: `parking_lot`'s locks, as far as `locks` uses them, made of its own.

use std::sync::{PoisonError, TryLockError};

use shuttle::sync;

pub use shuttle::thread;
pub use sync::{atomic::AtomicU64, mpsc};

pub(super) use sync::{MutexGuard, RwLockReadGuard, RwLockWriteGuard};

/// A lock that one thread holds at a time.
#[derive(Debug)]
pub(super) struct Mutex<T>(sync::Mutex<T>);

/// A lock that many readers hold at a time, or one writer.
#[derive(Debug)]
pub(super) struct RwLock<T>(sync::RwLock<T>);

impl<T> Mutex<T> {
    pub(super) fn new(value: T) -> Self {
        Self(sync::Mutex::new(value))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> RwLock<T> {
    pub(super) fn new(value: T) -> Self {
        Self(sync::RwLock::new(value))
    }

    pub(super) fn read(&self) -> RwLockReadGuard<'_, T> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn try_read(&self) -> Option<RwLockReadGuard<'_, T>> {
        match self.0.try_read() {
            Ok(value) => Some(value),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    pub(super) fn write(&self) -> RwLockWriteGuard<'_, T> {
        self.0.write().unwrap_or_else(PoisonError::into_inner)
    }
}
