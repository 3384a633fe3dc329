//! `parking_lot`'s locks, as far as a map uses them, made of the model checker's.

use std::fmt::{self, Debug};
use std::ops::{Deref, DerefMut};
use std::sync::PoisonError;

use shuttle::sync;

/// One thread at a time.
#[derive(Debug, Default)]
pub(in crate::map) struct Mutex<T>(sync::Mutex<T>);

/// Holds a [`Mutex`].
pub(in crate::map) type MutexGuard<'a, T> = sync::MutexGuard<'a, T>;

impl<T> Mutex<T> {
    pub(in crate::map) fn new(value: T) -> Self {
        Self(sync::Mutex::new(value))
    }

    pub(in crate::map) fn lock(&self) -> MutexGuard<'_, T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Many readers, of whom one may become a writer, or one writer.
#[derive(Debug, Default)]
pub(in crate::map) struct RwLock<T> {
    /// Held by who writes, or may come to.
    changing: Mutex<()>,
    value: sync::RwLock<T>,
}

/// Holds a [`RwLock`] to read.
pub struct RwLockReadGuard<'a, T>(sync::RwLockReadGuard<'a, T>);

/// The same, of who may come to write.
pub(in crate::map) struct RwLockUpgradableReadGuard<'a, T> {
    value: RwLockReadGuard<'a, T>,
    changing: MutexGuard<'a, ()>,
    lock: &'a RwLock<T>,
}

/// Holds a [`RwLock`] to write.
pub(in crate::map) struct RwLockWriteGuard<'a, T> {
    value: sync::RwLockWriteGuard<'a, T>,
    _changing: MutexGuard<'a, ()>,
}

impl<T> RwLock<T> {
    pub(in crate::map) fn new(value: T) -> Self {
        Self { changing: Mutex::new(()), value: sync::RwLock::new(value) }
    }

    pub(in crate::map) fn read(&self) -> RwLockReadGuard<'_, T> {
        RwLockReadGuard(self.value.read().unwrap_or_else(PoisonError::into_inner))
    }

    pub(in crate::map) fn upgradable_read(&self) -> RwLockUpgradableReadGuard<'_, T> {
        let changing = self.changing.lock();
        RwLockUpgradableReadGuard { value: self.read(), changing, lock: self }
    }

    pub(in crate::map) fn write(&self) -> RwLockWriteGuard<'_, T> {
        let changing = self.changing.lock();
        self.write_in_turn(changing)
    }

    fn write_in_turn<'a>(&'a self, changing: MutexGuard<'a, ()>) -> RwLockWriteGuard<'a, T> {
        let value = self.value.write().unwrap_or_else(PoisonError::into_inner);
        RwLockWriteGuard { value, _changing: changing }
    }
}

impl<'a, T> RwLockUpgradableReadGuard<'a, T> {
    /// Waits until the other readers are gone; nobody writes in between.
    pub(in crate::map) fn upgrade(this: Self) -> RwLockWriteGuard<'a, T> {
        let Self { value, changing, lock } = this;
        drop(value);
        lock.write_in_turn(changing)
    }
}

impl<T> Deref for RwLockReadGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> Deref for RwLockUpgradableReadGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> Deref for RwLockWriteGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for RwLockWriteGuard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Debug> Debug for RwLockReadGuard<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
