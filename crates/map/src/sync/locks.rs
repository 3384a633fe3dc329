//! A mutex and a reader-writer lock with a [`Rank`] each.

use std::fmt::{self, Debug, Formatter};
use std::ops::{Deref, DerefMut};

use super::checks::{Held, hold, may_wait};
use super::primitive;
use super::rank::Rank;

/// A lock that one thread holds at a time.
#[derive(Debug)]
pub struct Mutex<T> {
    rank: Rank,
    value: primitive::Mutex<T>,
}

/// A lock that many readers hold at a time, or one writer. A waiting writer goes before readers that come later.
#[derive(Debug)]
pub struct RwLock<T> {
    rank: Rank,
    value: primitive::RwLock<T>,
}

impl<T> Mutex<T> {
    /// A lock of that rank on `value`.
    pub fn new(rank: Rank, value: T) -> Self {
        Self { rank, value: primitive::Mutex::new(value) }
    }

    /// Waits for the lock.
    #[track_caller]
    pub fn lock(&self) -> MutexGuard<'_, T> {
        may_wait(self.rank);
        MutexGuard { value: self.value.lock(), _held: hold(self.rank) }
    }
}

impl<T> RwLock<T> {
    /// A lock of that rank on `value`.
    pub fn new(rank: Rank, value: T) -> Self {
        Self { rank, value: primitive::RwLock::new(value) }
    }

    /// Waits for the lock, to read.
    #[track_caller]
    pub fn read(&self) -> RwLockReadGuard<'_, T> {
        may_wait(self.rank);
        RwLockReadGuard { value: self.value.read(), _held: hold(self.rank) }
    }

    /// Takes the lock to read where nobody writes or waits to write.
    pub fn try_read(&self) -> Option<RwLockReadGuard<'_, T>> {
        let value = self.value.try_read()?;
        Some(RwLockReadGuard { value, _held: hold(self.rank) })
    }

    /// Waits for the lock, to write.
    #[track_caller]
    pub fn write(&self) -> RwLockWriteGuard<'_, T> {
        may_wait(self.rank);
        RwLockWriteGuard { value: self.value.write(), _held: hold(self.rank) }
    }
}

/// Holds a [`Mutex`].
#[must_use = "the lock is given back at once"]
pub struct MutexGuard<'a, T> {
    value: primitive::MutexGuard<'a, T>,
    _held: Held,
}

/// Holds a [`RwLock`] to read.
#[must_use = "the lock is given back at once"]
pub struct RwLockReadGuard<'a, T> {
    value: primitive::RwLockReadGuard<'a, T>,
    _held: Held,
}

/// Holds a [`RwLock`] to write.
#[must_use = "the lock is given back at once"]
pub struct RwLockWriteGuard<'a, T> {
    value: primitive::RwLockWriteGuard<'a, T>,
    _held: Held,
}

impl<T> Deref for MutexGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for MutexGuard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T> Deref for RwLockReadGuard<'_, T> {
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

impl<T: Debug> Debug for MutexGuard<'_, T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: Debug> Debug for RwLockReadGuard<'_, T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: Debug> Debug for RwLockWriteGuard<'_, T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(all(test, not(feature = "shuttle")))]
mod tests {
    use super::*;
    use crate::sync::before_file_operation;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    fn refused(breach: impl FnOnce()) -> String {
        let panic = catch_unwind(AssertUnwindSafe(breach)).expect_err("a breach panics");
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        panic.downcast_ref::<String>().cloned().or(text).expect("a message")
    }

    #[test]
    fn locks_are_taken_in_the_order_of_their_ranks() {
        let first = RwLock::new(Rank::Shard(1), ());
        let second = RwLock::new(Rank::Trajectory, ());
        let (_first, _second) = (first.read(), second.read());
        let message = refused(|| drop(first.read()));
        assert!(message.contains("Shard(1)") && message.contains("Trajectory"), "{message}");
        assert!(refused(|| drop(second.read())).contains("Trajectory"));
    }

    #[test]
    fn a_lock_that_was_given_back_is_forgotten() {
        let (first, second) = (Mutex::new(Rank::Journal, ()), Mutex::new(Rank::Snapshots, ()));
        drop(first.lock());
        drop(second.lock());
    }

    #[test]
    fn no_file_operation_starts_under_a_lock_of_a_maps_content() {
        let (journal, shard) = (Mutex::new(Rank::Journal, ()), RwLock::new(Rank::Shard(0), ()));
        let _journal = journal.lock();
        before_file_operation();
        let _shard = shard.read();
        assert!(refused(before_file_operation).contains("Shard(0)"));
    }

    #[test]
    fn a_runtime_thread_tries_and_does_not_wait() {
        let (shard, brief) = (RwLock::new(Rank::Shard(0), 1), Mutex::new(Rank::Brief, 2));
        let task = crate::sync::polled_by_runtime(async {
            assert_eq!((shard.try_read().map(|value| *value), *brief.lock()), (Some(1), 2));
            assert!(refused(|| drop(shard.read())).contains("runtime thread"));
            assert!(refused(before_file_operation).contains("runtime thread"));
        });
        let polled = std::pin::pin!(task).poll(&mut std::task::Context::from_waker(std::task::Waker::noop()));
        assert!(polled.is_ready());
        assert_eq!(*shard.read(), 1);
    }
}
