//! The rules of the locks, checked where `debug_assertions` are on.

use super::rank::Rank;

/// A lock that the present thread holds; dropped with the guard.
#[derive(Debug)]
pub(super) struct Held(#[cfg(debug_assertions)] Rank);

#[cfg(not(debug_assertions))]
mod state {
    use super::{Held, Rank};

    #[inline(always)]
    pub(in crate::sync) fn may_wait(_: Rank) {}

    #[inline(always)]
    pub(in crate::sync) fn hold(_: Rank) -> Held {
        Held()
    }

    /// Checks nothing: of release builds.
    #[inline(always)]
    pub fn before_file_operation() {}

    /// Checks nothing: of release builds.
    #[inline(always)]
    pub fn before_pause() {}
}

#[cfg(debug_assertions)]
mod state {
    use std::cell::{Cell, RefCell};

    use super::{Held, Rank};

    #[cfg(feature = "shuttle")]
    use shuttle::thread_local;

    thread_local! {
        /// The ranks of the locks that this thread holds, in the order in which it took them.
        static HELD: RefCell<Vec<Rank>> = const { RefCell::new(Vec::new()) };
        /// How many futures, one within the other, this thread polls just now.
        static POLLED: Cell<usize> = const { Cell::new(0) };
    }

    /// Checks that this thread may wait for a lock of that rank.
    ///
    /// # Panics
    /// When it polls an async task, or holds a lock of the same rank or a later one.
    #[track_caller]
    pub(in crate::sync) fn may_wait(rank: Rank) {
        let polled = POLLED.with(Cell::get);
        assert!(polled == 0 || rank == Rank::Brief, "a runtime thread waits for the lock {rank:?}");
        check_order(rank);
    }

    #[track_caller]
    fn check_order(rank: Rank) {
        let held = HELD.with(|held| held.borrow().iter().copied().max());
        assert!(held.is_none_or(|held| held < rank), "the lock {rank:?} is taken while {held:?} is held");
    }

    /// Notes that this thread holds a lock of that rank.
    pub(in crate::sync) fn hold(rank: Rank) -> Held {
        HELD.with(|held| held.borrow_mut().push(rank));
        Held(rank)
    }

    impl Drop for Held {
        fn drop(&mut self) {
            HELD.with(|held| {
                let mut held = held.borrow_mut();
                if let Some(at) = held.iter().rposition(|&rank| rank == self.0) {
                    held.remove(at);
                }
            });
        }
    }

    /// Checks that this thread may start a file operation.
    ///
    /// # Panics
    /// When it holds a lock of a map's content, or polls an async task.
    #[track_caller]
    pub fn before_file_operation() {
        let held =
            HELD.with(|held| held.borrow().iter().copied().find(|rank| rank.forbids_file_operations()));
        assert!(held.is_none(), "a file operation starts while the lock {held:?} is held");
        assert!(POLLED.with(Cell::get) == 0, "a runtime thread starts a file operation");
    }

    /// Checks that this thread may wait until others have done some of their work.
    ///
    /// # Panics
    /// When it holds a lock, for which they may wait.
    #[track_caller]
    pub fn before_pause() {
        let held = HELD.with(|held| held.borrow().last().copied());
        assert!(held.is_none(), "a pause begins while the lock {held:?} is held");
    }

    /// Counts a poll while it lives.
    pub(super) struct Polling;

    impl Polling {
        pub(super) fn begin() -> Self {
            POLLED.with(|polled| polled.set(polled.get() + 1));
            Self
        }
    }

    impl Drop for Polling {
        fn drop(&mut self) {
            POLLED.with(|polled| polled.set(polled.get() - 1));
        }
    }
}

pub use state::{before_file_operation, before_pause};
pub(super) use state::{hold, may_wait};

/// Tells the checks that whoever polls `future` is a runtime thread.
#[cfg(debug_assertions)]
pub fn polled_by_runtime<F: Future>(future: F) -> impl Future<Output = F::Output> {
    let mut future = Box::pin(future);
    std::future::poll_fn(move |context| {
        let _polling = state::Polling::begin();
        future.as_mut().poll(context)
    })
}

/// Tells the checks, of which a release build has none, that whoever polls `future` is a runtime thread.
#[cfg(not(debug_assertions))]
pub fn polled_by_runtime<F: Future>(future: F) -> F {
    future
}
