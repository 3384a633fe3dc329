//! Why a cloud has no times of points.

use super::unit::TimeUnit;
use crate::cloud::TIME_FIELDS;

/// Why a cloud has no times of points: it is mapped as if it was measured at once.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTimes {
    /// The cloud has no field of a known name.
    #[error("the clouds have none of the fields {}", TIME_FIELDS.join(", "))]
    NoField,
    /// No point of the cloud is one.
    #[error("no point of the cloud is a return")]
    NoReturns,
    /// A time that is no number.
    #[error("field {field} has a time that is no number, at a point that is a return")]
    NotFinite {
        /// The field.
        field: String,
    },
    /// All times are the same.
    #[error("field {field} is {value} at all points")]
    AllEqual {
        /// The field.
        field: String,
        /// The time.
        value: f64,
    },
    /// Both the stamp and 1970 may be what they count from, as the clock is near 1970.
    #[error(
        "the times in field {field} may count from the stamp or from the begin of the clock, which are too near each \
         other to tell; --times {field}:UNIT:FROM says which"
    )]
    TwoOrigins {
        /// The field.
        field: String,
    },
    /// The numbers are those of a sweep in no unit.
    #[error(
        "field {field} runs from {first} to {last}: that is a sweep of 1 ms to 1 s in none of s, ms, us, ns; \
         --times {field}:UNIT:FROM says what it is"
    )]
    NoUnit {
        /// The field.
        field: String,
        /// The least time.
        first: f64,
        /// The largest.
        last: f64,
    },
    /// The numbers are too far apart, or too far from the stamp, in the unit that the clouds before have.
    #[error("field {field}, in {}, has times from {first_s} to {last_s} s from the stamp, and 1.5 s are believed", unit.as_str())]
    TooFar {
        /// The field.
        field: String,
        /// Its unit.
        unit: TimeUnit,
        /// The least time from the stamp, seconds.
        first_s: f64,
        /// The largest.
        last_s: f64,
    },
}
