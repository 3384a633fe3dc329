//! When long work is to end early: its caller has gone, or its time is up. And when it gives way to other work.

use std::fmt::{Debug, Formatter};
use std::time::{Duration, Instant};

use crate::sync::before_pause;

/// Lets other work go first, where some waits.
pub trait GiveWay {
    /// True where other work waits, and the work that calls this has had its part: a call of [`GiveWay::give_way`]
    /// would wait for the other.
    fn is_due(&self) -> bool;

    /// Returns when the work that calls this is to go on: at once, or after other work.
    fn give_way(&self);

    /// How long the work has waited here, in all.
    fn paused_for(&self) -> Duration;
}

/// Tells long work when to end early. Every loop that may take longer than a few milliseconds asks it between its
/// steps, and returns when it says so; what such work returns then means nothing, or is marked as cut short.
#[derive(Clone, Copy)]
pub struct StopSignal<'a> {
    is_cancelled: Option<&'a dyn Fn() -> bool>,
    /// As if the work never paused.
    deadline: Option<Instant>,
    turns: Option<&'a dyn GiveWay>,
}

impl<'a> StopSignal<'a> {
    /// Work that goes on to its end.
    pub const NEVER: StopSignal<'static> = StopSignal { is_cancelled: None, deadline: None, turns: None };

    /// Stops work once `is_cancelled` says true, which it must then go on saying.
    pub fn when(is_cancelled: &'a dyn Fn() -> bool) -> Self {
        Self { is_cancelled: Some(is_cancelled), deadline: None, turns: None }
    }

    /// The same, where work lets other work go first by `turns`.
    #[must_use]
    pub fn giving_way_by(self, turns: &'a dyn GiveWay) -> Self {
        Self { turns: Some(turns), ..self }
    }

    /// True where [`StopSignal::give_way`] would let other work go first: the holder of a lock asks before it gives it
    /// back for that.
    pub fn is_way_due(self) -> bool {
        self.turns.is_some_and(GiveWay::is_due)
    }

    /// Lets other work go first, where some waits: to be called between the parts of long work, while no lock is held.
    /// What time that takes counts for no deadline.
    ///
    /// # Panics
    /// In tests, where a lock is held and the work is one that gives way.
    #[track_caller]
    pub fn give_way(self) {
        if let Some(turns) = self.turns {
            before_pause();
            turns.give_way();
        }
    }

    /// How long the work has let other work go first, in all.
    pub fn paused_for(self) -> Duration {
        self.turns.map_or(Duration::ZERO, GiveWay::paused_for)
    }

    /// Stops work at `deadline` as well, or earlier where this signal had an earlier one. The deadline moves on by as
    /// long as the work pauses after this.
    #[must_use]
    pub fn by(self, deadline: Instant) -> Self {
        let deadline = deadline.checked_sub(self.paused_for()).unwrap_or(deadline);
        Self { deadline: Some(self.deadline.map_or(deadline, |earlier| earlier.min(deadline))), ..self }
    }

    /// True once nobody waits for the answer: whatever it would be, it goes nowhere.
    pub fn is_cancelled(self) -> bool {
        self.is_cancelled.is_some_and(|is_cancelled| is_cancelled())
    }

    /// True once the deadline has passed.
    pub fn is_time_up(self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline + self.paused_for())
    }

    /// True once the work is to end, for either reason.
    pub fn is_stopped(self) -> bool {
        self.is_cancelled() || self.is_time_up()
    }

    /// The items, with a look before the first and before every so many more. Once stopped there are no more of them,
    /// so that who needs them all asks again at the end.
    pub fn paced<I: IntoIterator>(
        self,
        items: I,
        items_per_look: usize,
    ) -> impl Iterator<Item = I::Item> + use<'a, I> {
        let goes_on = move |at: usize| !at.is_multiple_of(items_per_look) || !self.is_stopped();
        items.into_iter().enumerate().take_while(move |(at, _)| goes_on(*at)).map(|(_, item)| item)
    }

    /// The pieces of a slice, with a look at the signal before each; they end once stopped.
    pub fn pieces<T>(
        self,
        items: &[T],
        items_per_look: usize,
    ) -> impl Iterator<Item = &[T]> + use<'_, 'a, T> {
        items.chunks(items_per_look).take_while(move |_| !self.is_stopped())
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
    fn paced_work_looks_once_for_so_many_items_and_ends_when_stopped() {
        let looks = Cell::new(0);
        let stops_at = |most: usize| move |looks: &Cell<usize>| looks.replace(looks.get() + 1) >= most;
        for (most, items, expected) in [(usize::MAX, 100, 10), (3, 30, 4), (0, 0, 1)] {
            looks.set(0);
            let stops = || stops_at(most)(&looks);
            assert_eq!(StopSignal::when(&stops).paced(0..100, 10).count(), items);
            assert_eq!(looks.get(), expected);
            looks.set(0);
            assert_eq!(StopSignal::when(&stops).pieces(&[0; 100], 10).flatten().count(), items);
            assert_eq!(looks.get(), expected);
        }
    }

    struct Paused(Cell<Duration>);
    impl GiveWay for Paused {
        fn is_due(&self) -> bool {
            true
        }

        fn give_way(&self) {
            self.0.set(self.0.get() + Duration::from_secs(60));
        }

        fn paused_for(&self) -> Duration {
            self.0.get()
        }
    }

    #[test]
    fn a_pause_moves_the_deadline() {
        let (turns, begin) = (Paused(Cell::default()), Instant::now());
        let signal = StopSignal::NEVER.giving_way_by(&turns);
        let before = signal.by(begin - Duration::from_secs(30));
        assert!(before.is_time_up());
        before.give_way();
        assert!(!before.is_time_up());
        // A pause before it was set does not count.
        assert!(signal.by(begin).is_time_up());
        assert!(!signal.by(begin + Duration::from_secs(30)).is_time_up());
    }

    #[test]
    #[should_panic(expected = "a pause begins while the lock")]
    fn work_does_not_pause_while_it_holds_a_lock() {
        let lock = crate::sync::Mutex::new(crate::sync::Rank::Brief, ());
        let (_held, turns) = (lock.lock(), Paused(Cell::default()));
        StopSignal::NEVER.giving_way_by(&turns).give_way();
    }

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
