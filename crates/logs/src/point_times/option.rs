//! What a user says of the times of points.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use super::rule::{TimesFrom, TimesRule};
use super::unit::TimeUnit;

/// What a user says of the times of points: `FIELD:UNIT:FROM`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimesOption {
    /// The field.
    pub field: String,
    /// Its unit and origin.
    pub rule: TimesRule,
}

/// A text that says nothing of times.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "times are FIELD:UNIT:FROM, such as t:ns:stamp, with a unit s, ms, us or ns, and from stamp, epoch, first or last; got {0:?}"
)]
pub struct BadTimesOption(String);

impl FromStr for TimesOption {
    type Err = BadTimesOption;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let bad = || BadTimesOption(text.to_owned());
        let [field, unit, from] = text.split(':').collect::<Vec<_>>()[..] else { return Err(bad()) };
        let unit = TimeUnit::ALL.into_iter().find(|known| known.as_str() == unit).ok_or_else(bad)?;
        let from = TimesFrom::ALL.into_iter().find(|known| known.as_str() == from).ok_or_else(bad)?;
        match field.is_empty() {
            true => Err(bad()),
            false => Ok(Self { field: field.to_owned(), rule: TimesRule { unit, from } }),
        }
    }
}

impl Display for TimesOption {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { field, rule: TimesRule { unit, from } } = self;
        write!(f, "{field}:{}:{}", unit.as_str(), from.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_reads_as_it_is_written() {
        for text in ["t:ns:stamp", "time:s:last", "timestamp:us:epoch", "x:ms:first"] {
            assert_eq!(text.parse::<TimesOption>().unwrap().to_string(), text);
        }
        for text in ["t", "t:ns", "t:h:stamp", "t:ns:now", ":ns:stamp", "t:ns:stamp:x"] {
            let error = text.parse::<TimesOption>().unwrap_err().to_string();
            assert!(error.contains(text) && error.contains("FIELD:UNIT:FROM"), "{error}");
        }
    }
}
