//! How long one request may take of the threads for work that uses the CPU.

use std::fmt::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::error::{Reason, ServiceError};
use mrol_map::util::StopSignal;

/// Shorter waiting is not worth a word.
const WAITED_MIN: Duration = Duration::from_millis(100);

/// A named limit, counted from when a thread first takes the request in hand: what it waits for before, its caller's
/// deadline bounds. The time while it gives way to others does not count; that for which it waits for another thread
/// does, and an error tells it. A clone is the same limit of the same request.
#[derive(Debug, Clone)]
pub(crate) struct TimeLimit {
    name: &'static str,
    most: Duration,
    ends: Arc<Mutex<Option<Instant>>>,
    waited: Arc<Mutex<Duration>>,
}

impl TimeLimit {
    /// The limit `limits.NAME_s` of the settings, which is so many seconds.
    pub(crate) fn new(name: &'static str, most_s: f64) -> Self {
        Self { name, most: Duration::from_secs_f64(most_s), ends: Arc::default(), waited: Arc::default() }
    }

    /// Runs `job` under `stop` and this limit. An error of a job that was stopped in time names the limit.
    pub(crate) fn run<T>(
        &self,
        stop: StopSignal<'_>,
        job: impl FnOnce(StopSignal<'_>) -> Result<T, ServiceError>,
    ) -> Result<T, ServiceError> {
        let (ends, paused_for) = (self.ends(), stop.paused_for());
        let done = job(stop.by(ends));
        let paused_for = stop.paused_for().saturating_sub(paused_for);
        let moved = self.ends() + paused_for;
        *self.ends.lock() = Some(moved);
        done.map_err(|error| self.named(error))
    }

    /// When the time is up: it begins now, unless it did before.
    fn ends(&self) -> Instant {
        *self.ends.lock().get_or_insert_with(|| Instant::now() + self.most)
    }

    /// Waits for `turn`, for as long as is left.
    ///
    /// # Errors
    /// The limit, once it is over.
    pub(crate) async fn wait<T>(&self, turn: impl Future<Output = T>) -> Result<T, ServiceError> {
        let (begin, ends) = (Instant::now(), self.ends());
        let turn = tokio::time::timeout_at(ends.into(), turn).await;
        *self.waited.lock() += begin.elapsed();
        turn.map_err(|_| self.named(ServiceError::new(Reason::TimeLimit, "")))
    }

    /// The error, and where it says that the time is up, which time.
    pub(super) fn named(&self, error: ServiceError) -> ServiceError {
        if error.reason != Reason::TimeLimit {
            return error;
        }
        let mut message =
            format!("the request took longer than limits.{}_s allows, which is {:?}", self.name, self.most);
        let waited = *self.waited.lock();
        if waited >= WAITED_MIN {
            let _ = write!(
                message,
                "; for {:.1} s of it others had their turns: send fewer scans that fail at once, or send it again later",
                waited.as_secs_f64()
            );
        }
        ServiceError { message, ..error }
    }
}

/// Ends work that nobody waits for, or that takes too long.
///
/// # Errors
/// `caller_gone` if the caller has disconnected (never sent); `time_limit` when the time is up.
pub(crate) fn check_not_stopped(stop: StopSignal<'_>) -> Result<(), ServiceError> {
    if stop.is_stopped() { Err(ended_early(stop)) } else { Ok(()) }
}

/// Why work ended that was stopped.
pub(crate) fn ended_early(stop: StopSignal<'_>) -> ServiceError {
    let (reason, message) = match stop.is_cancelled() {
        true => (Reason::CallerGone, "nobody waits for the answer"),
        false => (Reason::TimeLimit, "the request took too long"),
    };
    ServiceError::new(reason, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_whose_time_is_up_is_told_which_limit_and_who_has_gone_is_not() {
        let limit = TimeLimit::new("alignment_time_max", 0.0);
        let error = limit.run(StopSignal::NEVER, check_not_stopped).unwrap_err();
        assert_eq!(error.reason, Reason::TimeLimit);
        assert!(
            error.message.contains("limits.alignment_time_max_s allows, which is 0ns"),
            "{}",
            error.message
        );
        let gone = || true;
        let error = limit.run(StopSignal::when(&gone), check_not_stopped).unwrap_err();
        assert_eq!(error.reason, Reason::CallerGone);
        let patient = TimeLimit::new("undo_time_max", 3600.0);
        assert_eq!(patient.run(StopSignal::NEVER, |stop| check_not_stopped(stop).map(|()| 1)).unwrap(), 1);
    }

    #[tokio::test]
    async fn who_waited_for_others_is_told_how_long() {
        let limit = TimeLimit::new("insertion_time_max", 0.2);
        let error = limit.wait(std::future::pending::<()>()).await.unwrap_err();
        assert!(error.message.contains("insertion_time_max_s allows"), "{}", error.message);
        assert!(error.message.contains("s of it others had their turns"), "{}", error.message);
        let at_once = TimeLimit::new("insertion_time_max", 0.0);
        at_once.wait(std::future::ready(())).await.unwrap();
        let error = at_once.run(StopSignal::NEVER, check_not_stopped).unwrap_err();
        assert!(!error.message.contains("others"), "{}", error.message);
    }

    #[test]
    fn the_time_of_a_request_that_is_tried_again_goes_on() {
        let limit = TimeLimit::new("undo_time_max", 3600.0);
        let ends = |limit: &TimeLimit| {
            limit.run(StopSignal::NEVER, |_| Ok(())).unwrap();
            limit.ends()
        };
        let first = ends(&limit);
        assert_eq!(ends(&limit.clone()), first);
    }
}
