//! When what was not answered is sent again, and for how long that is tried.

use std::time::Duration;

use tokio::time::Instant;

use mrol_client::ClientError;
use tonic::Code;

const PAUSE_FIRST: Duration = Duration::from_millis(50);
const PAUSE_MAX: Duration = Duration::from_secs(1);

/// Reasons of refusals that are over soon. A refused scan changed nothing, so it may be sent again. A stream of scans
/// is not sent on to a node that holds the map; the next one goes there.
const PASSING: [&str; 6] =
    ["overloaded", "starting", "draining", "catalog_busy", "body_stalled", "map_elsewhere"];

/// True of a failure that may be over soon: a connection that broke, a server that restarts or is overloaded.
pub(super) fn is_passing(error: &ClientError) -> bool {
    match error {
        ClientError::Lost { .. } | ClientError::Unreachable { .. } => true,
        ClientError::Refused { reason: Some(reason), .. } => PASSING.contains(&reason.as_str()),
        // A proxy between the two.
        ClientError::Refused { code, reason: None, .. } => *code == Code::Unavailable,
        _ => false,
    }
}

/// The attempts at one scan, as many as there is patience for.
pub(super) struct Attempts {
    patience: Duration,
    failing_since: Option<Instant>,
    pause: Duration,
}

impl Attempts {
    /// Attempts for so long after the first that fails.
    pub(super) fn new(patience: Duration) -> Self {
        Self { patience, failing_since: None, pause: PAUSE_FIRST }
    }

    /// Forgets the failures so far: something was answered.
    pub(super) fn succeeded(&mut self) {
        *self = Self::new(self.patience);
    }

    /// True before the first failure.
    pub(super) fn is_first(&self) -> bool {
        self.failing_since.is_none()
    }

    /// Waits until the next attempt; false where the patience is over.
    pub(super) async fn pause(&mut self) -> bool {
        let since = *self.failing_since.get_or_insert_with(Instant::now);
        if since.elapsed() + self.pause > self.patience {
            return false;
        }
        tokio::time::sleep(self.pause).await;
        self.pause = (2 * self.pause).min(PAUSE_MAX);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn attempts_end_with_the_patience_and_begin_anew_after_an_answer() {
        let (start, mut attempts) = (Instant::now(), Attempts::new(Duration::from_secs(15)));
        let mut paused = 0;
        while attempts.pause().await {
            paused += 1;
        }
        let elapsed = start.elapsed();
        assert!(elapsed <= Duration::from_secs(15) && elapsed > Duration::from_secs(13), "{elapsed:?}");
        assert!((15..25).contains(&paused), "{paused}");
        attempts.succeeded();
        assert!(attempts.is_first() && attempts.pause().await);
        assert!(!Attempts::new(Duration::ZERO).pause().await);
    }

    #[test]
    fn refusals_that_pass_are_told_from_those_that_stay() {
        let refused = |code, reason: Option<&str>| ClientError::Refused {
            code,
            reason: reason.map(str::to_owned),
            message: String::new(),
            retry_after: None,
            elsewhere: Vec::new(),
        };
        assert!(is_passing(&refused(Code::Unavailable, Some("draining"))));
        assert!(is_passing(&refused(Code::Unavailable, None)));
        assert!(!is_passing(&refused(Code::Unavailable, Some("map_read_only"))));
        assert!(!is_passing(&refused(Code::NotFound, Some("map_not_found"))));
        assert!(is_passing(&ClientError::Lost { url: String::new(), cause: String::new() }));
    }
}
