//! How much work there is between two looks at the stop signal.

use crate::util::StopSignal;

/// Units of work between two looks. A unit takes some ten nanoseconds: a look-up of eight places in the field, a voxel or a
/// block that is considered.
const WORK_PER_LOOK: u32 = 8192;

/// The work of a question, counted so that the stop signal is looked at in proportion to it, whatever it asks.
#[derive(Debug)]
pub(super) struct Effort<'a> {
    stop: StopSignal<'a>,
    left: u32,
    is_stopped: bool,
}

impl<'a> Effort<'a> {
    pub(super) fn new(stop: StopSignal<'a>) -> Self {
        Self { stop, left: WORK_PER_LOOK, is_stopped: false }
    }

    /// Counts work; looks at the signal where there was enough of it.
    #[inline(always)]
    pub(super) fn spend(&mut self, work: u32) {
        match self.left.checked_sub(work) {
            Some(left) => self.left = left,
            None => self.look(),
        }
    }

    #[cold]
    fn look(&mut self) {
        self.left = WORK_PER_LOOK;
        self.is_stopped |= self.stop.is_stopped();
    }

    /// True once the signal was seen to stop the work.
    #[inline(always)]
    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopped
    }
}
