//! The caller's deadline (`grpc-timeout`), as the contract words it: `DEADLINE_EXCEEDED`.
//!
//! tonic's own answer to a call whose time is up is `CANCELLED`, so this one comes a little earlier.

use std::time::Duration;

use axum::http::HeaderMap;

use mrol_service::{Reason, ServiceError};

const HEADER: &str = "grpc-timeout";
/// How much earlier than the caller's deadline it is answered, at most, and at most this part of it.
const AHEAD_MAX: Duration = Duration::from_millis(20);
const AHEAD_PART: u32 = 10;

/// Waits for an answer no longer than the call's deadline allows.
///
/// # Errors
/// `DeadlineExceeded` when the time is up.
pub(super) async fn within<T>(
    deadline: Option<Duration>,
    answer: impl Future<Output = T>,
) -> Result<T, ServiceError> {
    let Some(deadline) = deadline else { return Ok(answer.await) };
    let ahead = AHEAD_MAX.min(deadline / AHEAD_PART);
    tokio::time::timeout(deadline - ahead, answer).await.map_err(|_| reached(deadline))
}

/// What to say of a call whose deadline has come.
pub(super) fn reached(deadline: Duration) -> ServiceError {
    let message = format!("the call's deadline of {deadline:?} was reached");
    ServiceError::new(Reason::Deadline, message)
}

/// The deadline of a call: up to eight digits and a unit; none where there is none or it cannot be read.
pub(super) fn of(headers: &HeaderMap) -> Option<Duration> {
    let mut digits = headers.get(HEADER)?.to_str().ok()?.chars();
    let unit = digits.next_back()?;
    let digits = digits.as_str();
    let value = u64::from(digits.parse::<u32>().ok().filter(|_| digits.len() <= 8)?);
    match unit {
        'H' => Some(Duration::from_secs(value * 3600)),
        'M' => Some(Duration::from_secs(value * 60)),
        'S' => Some(Duration::from_secs(value)),
        'm' => Some(Duration::from_millis(value)),
        'u' => Some(Duration::from_micros(value)),
        'n' => Some(Duration::from_nanos(value)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deadline(value: &'static str) -> Option<Duration> {
        of(&HeaderMap::from_iter([(axum::http::HeaderName::from_static(HEADER), value.parse().unwrap())]))
    }

    #[test]
    fn a_deadline_is_digits_and_a_unit() {
        assert_eq!(deadline("250m"), Some(Duration::from_millis(250)));
        assert_eq!(deadline("2H"), Some(Duration::from_secs(7200)));
        for none in ["", "m", "10", "-1S", "123456789S", "1x"] {
            assert_eq!(deadline(none), None, "{none}");
        }
        assert_eq!(of(&HeaderMap::new()), None);
    }

    #[tokio::test]
    async fn a_call_that_takes_too_long_is_told_so() {
        let late = within(Some(Duration::from_millis(5)), std::future::pending::<()>()).await.unwrap_err();
        assert_eq!(late.reason, Reason::Deadline);
        assert_eq!(late.message, "the call's deadline of 5ms was reached");
    }
}
