//! Whether a node is where the others are.

use std::time::{Duration, Instant};

/// Whether a node is where the others are, and since when it is not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Lag {
    /// It has not been there since it was started: a copy may be lacking as a whole.
    #[default]
    NotThereYet,
    /// It is there.
    No,
    /// It was there, and a copy is behind since then, or lacking.
    Since(Instant),
}

impl Lag {
    /// What follows once it is known whether a copy is behind `now`, or lacking.
    pub(super) fn then(self, is_behind: bool, now: Instant) -> Self {
        match self {
            _ if !is_behind => Self::No,
            Self::No => Self::Since(now),
            other => other,
        }
    }

    /// True of a node that has not been there yet, or has not been there for so long.
    pub(super) fn is_over(self, lag_max: Duration) -> bool {
        match self {
            Self::NotThereYet => true,
            Self::No => false,
            Self::Since(since) => since.elapsed() > lag_max,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_behind_until_it_was_where_the_others_are_and_from_then_on_after_a_while() {
        let (now, lag_max) = (Instant::now(), Duration::from_secs(3600));
        let begun = Lag::default().then(true, now);
        assert!(begun.is_over(lag_max), "a copy may be lacking as a whole");
        let there = begun.then(false, now);
        assert!(!there.is_over(Duration::ZERO));
        let later = there.then(true, now).then(true, now + Duration::from_secs(1));
        assert_eq!(later, Lag::Since(now));
        assert!(!later.is_over(lag_max));
        std::thread::sleep(Duration::from_millis(1));
        assert!(later.is_over(Duration::ZERO));
        assert!(!later.then(false, now).is_over(Duration::ZERO));
    }
}
