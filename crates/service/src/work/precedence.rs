//! Work that has precedence over a lane. While such work runs, the lane uses fewer of its threads.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

/// Time for which precedence lasts after the work has ended: robots scan several times a second.
const LINGERS: Duration = Duration::from_secs(1);

/// Work that has precedence. A clone is another handle on the same work.
#[derive(Debug, Clone)]
pub(super) struct Precedence {
    lingers: Duration,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    /// The last job in hand has ended.
    ended: Condvar,
}

#[derive(Debug, Default)]
struct State {
    at_work: usize,
    last_end: Option<Instant>,
}

/// A job that has precedence, until this is dropped.
#[derive(Debug)]
pub(super) struct AtWork(Precedence);

impl Default for Precedence {
    fn default() -> Self {
        Self::lingering(LINGERS)
    }
}

impl Precedence {
    /// Work that counts for so long after its end.
    pub(super) fn lingering(lingers: Duration) -> Self {
        Self { lingers, shared: Arc::default() }
    }

    pub(super) fn begin(&self) -> AtWork {
        self.shared.state.lock().at_work += 1;
        AtWork(self.clone())
    }

    /// Jobs in hand.
    pub(super) fn at_work(&self) -> usize {
        self.shared.state.lock().at_work
    }

    /// Waits until no job is in hand, for so long at most.
    pub(super) fn wait_while_at_work(&self, at_most: Duration) {
        let mut state = self.shared.state.lock();
        self.shared.ended.wait_while_for(&mut state, |state| state.at_work > 0, at_most);
    }

    /// True while a job is in hand, and a while after the last.
    pub(super) fn is_taken(&self) -> bool {
        let state = self.shared.state.lock();
        state.at_work > 0 || state.last_end.is_some_and(|end| end.elapsed() < self.lingers)
    }
}

impl Drop for AtWork {
    fn drop(&mut self) {
        let mut state = self.0.shared.state.lock();
        state.at_work -= 1;
        state.last_end = Some(Instant::now());
        if state.at_work == 0 {
            self.0.shared.ended.notify_all();
        }
    }
}
