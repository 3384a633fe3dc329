//! How much work there is between two checks of the stop signal.

use std::cell::Cell;

use crate::util::StopSignal;

/// Units of work between two checks of the stop signal. A unit takes some ten nanoseconds: a look-up of eight places in
/// the field, a voxel or a block that is considered, a test of a place and the box around a keep-out, or a corner of a
/// keep-out.
pub(super) const WORK_PER_STOP_CHECK: u32 = 8192;

/// The work of a question, counted so that the stop signal is checked in proportion to it, whatever it asks and however
/// few things it asks about.
#[derive(Debug)]
pub(super) struct Effort<'a> {
    stop: StopSignal<'a>,
    left: Cell<u32>,
    is_stopped: Cell<bool>,
}

impl<'a> Effort<'a> {
    /// Work that ends when `stop` says so.
    pub(super) fn until(stop: StopSignal<'a>) -> Self {
        Self { stop, left: Cell::new(WORK_PER_STOP_CHECK), is_stopped: Cell::new(false) }
    }

    /// Counts work; checks the signal where there was enough of it.
    #[inline(always)]
    pub(super) fn spend(&self, work: u32) {
        match self.left.get().checked_sub(work) {
            Some(left) => self.left.set(left),
            None => self.look(),
        }
    }

    #[cold]
    fn look(&self) {
        self.left.set(WORK_PER_STOP_CHECK);
        self.is_stopped.set(self.is_stopped.get() || self.stop.is_stopped());
    }

    /// True once the signal was seen to stop the work.
    #[inline(always)]
    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopped.get()
    }

    /// Counts work before it is done; false once stopped, when what is found means nothing.
    #[inline]
    pub(super) fn goes_on(&self, work: u32) -> bool {
        self.spend(work);
        !self.is_stopped()
    }

    /// The answers, all of which are made; none once stopped.
    pub(super) fn done<T>(self, answers: T) -> Option<T> {
        (!self.is_stopped() && !self.stop.is_stopped()).then_some(answers)
    }
}
