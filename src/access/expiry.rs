//! Until when a key counts.

use std::fmt;
use std::time::{Duration, SystemTime};

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// The moment from which on something counts no longer, to the second or finer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Expiry(OffsetDateTime);

impl Expiry {
    /// From an RFC 3339 date and time (`2027-01-31T12:00:00Z`), or from a date, which stands for its first moment in
    /// UTC. None for anything else: a time without an offset is nobody's.
    pub fn parse(text: &str) -> Option<Self> {
        let is_date = text.len() == "2027-01-31".len();
        let time = if is_date { format!("{text}T00:00:00Z") } else { text.to_owned() };
        OffsetDateTime::parse(&time, &Rfc3339).ok().map(Self)
    }

    /// The moment `duration` after `now`; none beyond what a calendar holds.
    pub fn after(now: SystemTime, duration: Duration) -> Option<Self> {
        let whole_s = OffsetDateTime::from(now).replace_nanosecond(0).ok()?;
        whole_s.checked_add(duration.try_into().ok()?).map(Self)
    }

    /// True from the moment itself on.
    pub fn is_past(self, now: SystemTime) -> bool {
        self.0 <= OffsetDateTime::from(now)
    }

    /// True where `now` is within `warning` of it, or past it.
    pub fn is_near(self, now: SystemTime, warning: Duration) -> bool {
        now.checked_add(warning).is_none_or(|then| self.is_past(then))
    }
}

impl fmt::Display for Expiry {
    /// As RFC 3339 writes it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.format(&Rfc3339).map_err(|_| fmt::Error)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_its_first_moment_and_a_time_names_its_offset() {
        let parse = |text| Expiry::parse(text).map(|expiry| expiry.0.unix_timestamp());
        assert_eq!(parse("2027-01-31"), Some(1_801_353_600));
        assert_eq!(parse("2027-01-31T02:00:00+02:00"), Some(1_801_353_600));
        for none in ["", "2027-02-30", "2027-01-31T12:00:00", "tomorrow", "2027-1-31T12:00:00Z"] {
            assert_eq!(Expiry::parse(none), None, "{none}");
        }
        assert_eq!(Expiry::parse("2027-01-31").unwrap().to_string(), "2027-01-31T00:00:00Z");
    }

    #[test]
    fn it_is_past_from_its_own_moment_on_and_near_before_that() {
        let expiry = Expiry::parse("2027-01-31").unwrap();
        let at = |s: u64| SystemTime::UNIX_EPOCH + Duration::from_secs(s);
        let (second, moment) = (Duration::from_secs(1), 1_801_353_600);
        assert!(!expiry.is_past(at(moment - 1)) && expiry.is_past(at(moment)));
        assert!(!expiry.is_near(at(moment - 2), second) && expiry.is_near(at(moment - 1), second));
        assert_eq!(Expiry::after(at(moment - 1), second), Some(expiry));
    }
}
