//! Work that others are not to wait for: it uses the cores that robots whose scans fit leave.
//!
//! Threads of a lower priority would do the same, but for one thing: where such a thread holds a lock of a map it
//! hardly runs, and all others wait for it. So this work pauses by itself, between its parts, where it holds no lock.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::precedence::Precedence;

/// How many times as long as it worked such work pauses at most: where robots leave no core, it has a fifth of one.
const PAUSE_MAX: u32 = 4;

/// The jobs of all lanes that do such work. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct Background {
    robots: Precedence,
    cores: usize,
    running: Arc<AtomicUsize>,
}

/// How long a job pauses in all, at most: its caller waits for an answer, for half a minute as clients are set.
const PAUSED_MAX: Duration = Duration::from_secs(5);

/// A job in hand, until this is dropped.
#[derive(Debug)]
pub(super) struct InBackground {
    background: Background,
    /// How long it may still pause.
    left: Duration,
}

impl Background {
    /// Work on what the jobs of `robots` leave of so many cores.
    pub(super) fn behind(robots: &Precedence, cores: usize) -> Self {
        Self { robots: robots.clone(), cores, running: Arc::default() }
    }

    pub(super) fn begin(&self) -> InBackground {
        self.running.fetch_add(1, Ordering::Relaxed);
        InBackground { background: self.clone(), left: PAUSED_MAX }
    }
}

impl InBackground {
    /// True while robots are at work, and they and this work together take all cores: one is left for what else the
    /// server does. Never of a job that paused for as long as it may.
    pub(super) fn is_due(&self) -> bool {
        let Background { robots, cores, running } = &self.background;
        let at_work = robots.at_work();
        !self.left.is_zero() && at_work > 0 && at_work + running.load(Ordering::Relaxed) >= *cores
    }

    /// Returns when robots are no longer at work, or soon, after so much work; a job pauses for no longer than
    /// [`PAUSED_MAX`] in all.
    pub(super) fn pause_after(&mut self, worked: Duration) {
        let begin = Instant::now();
        self.background.robots.wait_while_at_work((worked * PAUSE_MAX).min(self.left));
        self.left = self.left.saturating_sub(begin.elapsed());
    }
}

impl Drop for InBackground {
    fn drop(&mut self) {
        self.background.running.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_pauses_while_robots_want_its_core_and_no_longer_than_may() {
        let robots = Precedence::default();
        let two_cores = Background::behind(&robots, 2);
        let mut job = two_cores.begin();
        assert!(!job.is_due());
        let at_work = robots.begin();
        assert!(job.is_due());
        let (part, begin) = (Duration::from_millis(5), Instant::now());
        job.pause_after(part);
        assert!(begin.elapsed() >= part * PAUSE_MAX);
        // The end of the robots' work ends the pause.
        std::thread::scope(|threads| {
            threads.spawn(|| job.pause_after(Duration::from_secs(3600)));
            drop(at_work);
        });
        assert!(!job.is_due());
    }

    #[test]
    fn work_that_paused_for_as_long_as_it_may_goes_on_beside_robots() {
        let robots = Precedence::default();
        let one_core = Background::behind(&robots, 1);
        let mut job = one_core.begin();
        let _at_work = robots.begin();
        job.left = Duration::from_millis(30);
        let begin = Instant::now();
        for _ in 0..100 {
            job.pause_after(Duration::from_millis(5));
        }
        assert!(begin.elapsed() < Duration::from_millis(5) * PAUSE_MAX * 100);
        assert!(!job.is_due() && one_core.begin().is_due());
    }

    #[test]
    fn work_goes_on_where_there_are_cores_for_it() {
        let robots = Precedence::default();
        let eight_cores = Background::behind(&robots, 8);
        let _at_work = robots.begin();
        let jobs: Vec<_> = (0..6).map(|_| eight_cores.begin()).collect();
        assert!(!jobs[0].is_due());
        let one_more = eight_cores.begin();
        assert!(jobs[0].is_due() && one_more.is_due());
        drop(one_more);
        assert!(!jobs[0].is_due());
    }
}
