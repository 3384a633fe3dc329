//! Times of points: what a driver wrote, in seconds from the cloud's stamp.
//!
//! Drivers write `t` as nanoseconds from the first point, `time` as seconds that are negative, `timestamp` as seconds
//! or nanoseconds since 1970, all of them under names that others use for something else. So the unit follows from the
//! spread of the numbers: a sweep lasts 1 ms to 1 s, which is true of one unit alone.

mod error;
mod option;
mod rule;
mod unit;

pub use error::NoTimes;
pub use option::{BadTimesOption, TimesOption};
pub use rule::{TimesDoubt, TimesFrom, TimesRule};
pub use unit::TimeUnit;
