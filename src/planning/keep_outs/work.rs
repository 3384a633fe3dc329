//! How much was done since somebody last asked whether to stop.

use std::cell::Cell;

use crate::util::StopSignal;

/// Tests between two looks at the stop signal. A test is of a place and a box around a shape, or a corner of a shape.
pub(super) const TESTS_PER_LOOK: usize = 20_000;

/// Counts tests, and looks at the stop signal in proportion to them, however few things are asked about.
#[derive(Debug)]
pub(in crate::planning) struct Work<'a> {
    stop: StopSignal<'a>,
    since_look: Cell<usize>,
    is_stopped: Cell<bool>,
}

impl<'a> Work<'a> {
    /// Work that ends when `stop` says so.
    pub(in crate::planning) fn until(stop: StopSignal<'a>) -> Self {
        Self { stop, since_look: Cell::new(0), is_stopped: Cell::new(stop.is_stopped()) }
    }

    /// Counts tests before they are made; false once stopped, when what is found means nothing.
    pub(in crate::planning) fn goes_on(&self, tests: usize) -> bool {
        self.since_look.set(self.since_look.get() + tests);
        if self.since_look.get() >= TESTS_PER_LOOK && !self.is_stopped.get() {
            self.since_look.set(0);
            self.is_stopped.set(self.stop.is_stopped());
        }
        !self.is_stopped.get()
    }

    /// The answers, all of which are made; none once stopped.
    pub(in crate::planning) fn done<T>(self, answers: T) -> Option<T> {
        (!self.is_stopped.get() && !self.stop.is_stopped()).then_some(answers)
    }
}
