//! When long work is to end early: its caller has gone, or its time is up.

use std::fmt::{Debug, Formatter};
use std::time::Instant;

/// Tells long work when to end early. Every loop that may take longer than a few milliseconds asks it between its
/// steps, and returns when it says so; what such work returns then means nothing, or is marked as cut short.
#[derive(Clone, Copy)]
pub struct StopSignal<'a> {
    is_cancelled: Option<&'a dyn Fn() -> bool>,
    deadline: Option<Instant>,
}

impl<'a> StopSignal<'a> {
    /// Work that goes on to its end.
    pub const NEVER: StopSignal<'static> = StopSignal { is_cancelled: None, deadline: None };

    /// Stops work once `is_cancelled` says true, which it must then go on saying.
    pub fn when(is_cancelled: &'a dyn Fn() -> bool) -> Self {
        Self { is_cancelled: Some(is_cancelled), deadline: None }
    }

    /// Stops work at `deadline` as well, or earlier where this signal had an earlier one.
    #[must_use]
    pub fn by(self, deadline: Instant) -> Self {
        Self { deadline: Some(self.deadline.map_or(deadline, |earlier| earlier.min(deadline))), ..self }
    }

    /// True once nobody waits for the answer: whatever it would be, it goes nowhere.
    pub fn is_cancelled(self) -> bool {
        self.is_cancelled.is_some_and(|is_cancelled| is_cancelled())
    }

    /// True once the deadline has passed.
    pub fn is_time_up(self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// True once the work is to end, for either reason.
    pub fn is_stopped(self) -> bool {
        self.is_cancelled() || self.is_time_up()
    }
}

/// Prints the deadline; closures have no form to print.
impl Debug for StopSignal<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StopSignal").field("deadline", &self.deadline).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::time::Duration;

    #[test]
    fn work_is_stopped_by_its_caller_or_by_the_clock() {
        let gone = Cell::new(false);
        let caller_gone = || gone.get();
        let now = Instant::now();
        let signal = StopSignal::when(&caller_gone).by(now + Duration::from_secs(3600));
        assert!(!signal.is_stopped());
        assert!(signal.by(now).is_time_up() && signal.by(now).is_stopped());
        assert!(!signal.by(now).by(now + Duration::from_secs(7200)).is_cancelled());
        gone.set(true);
        assert!(signal.is_cancelled() && signal.is_stopped() && !signal.is_time_up());
        assert!(!StopSignal::NEVER.is_stopped());
    }
}
