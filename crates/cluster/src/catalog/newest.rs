//! The newest revision of the list that was seen.

use std::time::{Duration, Instant};

/// How long a server may lag. What is still older then is no lag: an older copy of the bucket was put back.
const LAG_MAX: Duration = Duration::from_secs(10);

/// The newest revision of the list that was seen, by which an answer of a server that lags is told from the list.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Newest {
    revision: u64,
    /// Since when all that is read is older.
    older_since: Option<Instant>,
}

/// What a revision that was read is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Read {
    /// The list.
    List,
    /// The list, of which an older copy was put back.
    PutBack,
    /// An answer of a server that lags.
    Late,
}

impl Newest {
    /// Notes a revision that was read.
    pub(super) fn read(&mut self, revision: u64, now: Instant) -> Read {
        if revision >= self.revision {
            *self = Self { revision, older_since: None };
            return Read::List;
        }
        let since = *self.older_since.get_or_insert(now);
        if now.duration_since(since) < LAG_MAX {
            return Read::Late;
        }
        *self = Self { revision, older_since: None };
        Read::PutBack
    }

    /// Notes a revision that this node made.
    pub(super) fn made(&mut self, revision: u64) {
        self.revision = self.revision.max(revision);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_older_for_a_moment_is_late_and_what_stays_so_is_the_list() {
        let begun = Instant::now();
        let at = |seconds| begun + Duration::from_secs(seconds);
        let mut newest = Newest::default();
        assert_eq!(newest.read(5, at(0)), Read::List);
        newest.made(7);
        assert_eq!(newest.read(6, at(1)), Read::Late);
        assert_eq!(newest.read(7, at(2)), Read::List);
        assert_eq!(newest.read(3, at(3)), Read::Late, "counted anew");
        assert_eq!(newest.read(3, at(12)), Read::Late);
        assert_eq!(newest.read(3, at(13)), Read::PutBack);
        assert_eq!(newest.read(3, at(13)), Read::List);
        assert_eq!(newest.read(4, at(14)), Read::List, "it goes on from there");
    }
}
