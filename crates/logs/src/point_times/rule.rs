//! How the times of a log's points are to be read.

use std::collections::BTreeMap;

use super::error::NoTimes;
use super::unit::TimeUnit;
use crate::cloud::{Cloud, RawTimes, TimeValues};

/// Shortest sweep of a lidar, nanoseconds.
const SWEEP_MIN_NS: f64 = 1e6;
/// Longest sweep, nanoseconds.
const SWEEP_MAX_NS: f64 = 1e9;
/// Times this far from the stamp are those of its sweep, nanoseconds: the longest sweep, and half of one more for a
/// stamp that is taken when a message is sent.
const FROM_STAMP_MAX_NS: i64 = 1_500_000_000;
/// Of two origins the nearer one is taken where they differ by more than this share of the sweep.
const ORIGINS_APART: f64 = 0.2;
/// Share of points that may be older than the one before them of the same laser: second returns are.
const DESCENTS_MAX: f64 = 0.01;

/// From where times count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimesFrom {
    /// From the cloud's stamp; negative where the stamp is the end of the sweep.
    Stamp,
    /// From 1970, by the clock of the stamps.
    Epoch,
    /// The first point was measured at the stamp, whatever its number says.
    First,
    /// The last point was.
    Last,
}

impl TimesFrom {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Stamp, Self::Epoch, Self::First, Self::Last];

    /// Its name.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Stamp => "stamp",
            Self::Epoch => "epoch",
            Self::First => "first",
            Self::Last => "last",
        }
    }
}

/// How the times of a log's points are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimesRule {
    /// Their unit.
    pub unit: TimeUnit,
    /// From where they count.
    pub from: TimesFrom,
}

/// What is odd about times that are used all the same.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimesDoubt {
    /// The sensor's clock is not that of the stamps.
    #[error(
        "the times of points are by another clock than the stamps, {0:.0} s off: the first point is taken to be at the stamp"
    )]
    OtherClock(f64),
    /// Points of one laser do not come in the order of their times.
    #[error("{0:.0} % of the points are older than the one before them of the same laser")]
    NotAscending(f64),
}

impl TimesRule {
    /// The rule that the times of `cloud` follow, and what is odd about them.
    ///
    /// # Errors
    /// When they are not those of a sweep.
    pub fn find(cloud: &Cloud, raw: &RawTimes) -> Result<(Self, Vec<TimesDoubt>), NoTimes> {
        let (first, last) = span(cloud, raw)?;
        let field = || raw.field.clone();
        if first == last {
            return Err(NoTimes::AllEqual { field: field(), value: first });
        }
        let is_sweep = |unit: &TimeUnit| {
            (SWEEP_MIN_NS..=SWEEP_MAX_NS).contains(&((last - first) * unit.nanoseconds() as f64))
        };
        let unit = TimeUnit::ALL.into_iter().find(is_sweep);
        let unit = unit.ok_or_else(|| NoTimes::NoUnit { field: field(), first, last })?;
        let times_ns = nanoseconds(&raw.values, unit);
        let counted = || times_ns.iter().zip(&cloud.points).filter(|(_, point)| is_return(point));
        let is_near = |origin_ns: i64| {
            counted().all(|(&time, _)| time.saturating_sub(origin_ns).saturating_abs() <= FROM_STAMP_MAX_NS)
        };
        let mut doubts = Vec::new();
        let from = if is_near(0) && is_near(cloud.stamp_ns) {
            // A simulated clock begins at 0. A sweep begins or ends at its stamp, or the stamp lies in it.
            let (first_ns, last_ns) =
                counted().fold((i64::MAX, i64::MIN), |(a, b), (&time, _)| (a.min(time), b.max(time)));
            let off_ns = |origin_ns: i64| (first_ns - origin_ns).max(origin_ns - last_ns).max(0);
            let (off_stamp_ns, off_epoch_ns) = (off_ns(0), off_ns(cloud.stamp_ns));
            let least_ns = ORIGINS_APART * (last_ns - first_ns) as f64;
            if cloud.stamp_ns != 0 && ((off_stamp_ns - off_epoch_ns).abs() as f64) < least_ns {
                return Err(NoTimes::TwoOrigins { field: field() });
            }
            if off_stamp_ns <= off_epoch_ns { TimesFrom::Stamp } else { TimesFrom::Epoch }
        } else if is_near(0) {
            TimesFrom::Stamp
        } else if is_near(cloud.stamp_ns) {
            TimesFrom::Epoch
        } else {
            let first_ns = counted().map(|(&time, _)| time).min().unwrap_or_default();
            doubts.push(TimesDoubt::OtherClock(first_ns.saturating_sub(cloud.stamp_ns) as f64 * 1e-9));
            TimesFrom::First
        };
        let descents = descents(cloud, &times_ns);
        if descents > DESCENTS_MAX {
            doubts.push(TimesDoubt::NotAscending(100.0 * descents));
        }
        Ok((Self { unit, from }, doubts))
    }

    /// The times of the points of `cloud`, seconds from its stamp; those of points that are no returns may be NaN.
    ///
    /// # Errors
    /// When they are not within 1.5 s of it.
    pub fn times_s(self, cloud: &Cloud, raw: &RawTimes) -> Result<Vec<f32>, NoTimes> {
        span(cloud, raw)?;
        let times_ns = nanoseconds(&raw.values, self.unit);
        let counted = || {
            let counted = times_ns.iter().zip(&cloud.points).filter(|(_, point)| is_return(point));
            counted.map(|(&time, _)| time)
        };
        let (Some(first_ns), Some(last_ns)) = (counted().min(), counted().max()) else {
            return Err(NoTimes::NoReturns);
        };
        let origin_ns = match self.from {
            TimesFrom::Stamp => 0,
            TimesFrom::Epoch => cloud.stamp_ns,
            TimesFrom::First => first_ns,
            TimesFrom::Last => last_ns,
        };
        let from_stamp = |time_ns: i64| time_ns.saturating_sub(origin_ns);
        let is_near = |time_ns: i64| from_stamp(time_ns).saturating_abs() <= FROM_STAMP_MAX_NS;
        if !is_near(first_ns) || !is_near(last_ns) {
            let seconds = |time_ns: i64| from_stamp(time_ns) as f64 * 1e-9;
            return Err(NoTimes::TooFar {
                field: raw.field.clone(),
                unit: self.unit,
                first_s: seconds(first_ns),
                last_s: seconds(last_ns),
            });
        }
        let time_s = |&time_ns: &i64| match is_near(time_ns) {
            true => (from_stamp(time_ns) as f64 * 1e-9) as f32,
            false => f32::NAN,
        };
        Ok(times_ns.iter().map(time_s).collect())
    }
}

/// True of a point whose time counts: drivers leave anything in the others.
fn is_return(point: &mrol_map::geometry::Point) -> bool {
    point.is_finite() && point.xyz() != [0.0; 3]
}

/// The least and the largest time of points that are returns, as they are written.
fn span(cloud: &Cloud, raw: &RawTimes) -> Result<(f64, f64), NoTimes> {
    let mut counted = (f64::INFINITY, f64::NEG_INFINITY);
    let returns = cloud.points.iter().enumerate().filter(|(_, point)| is_return(point));
    for (k, _) in returns {
        let value = match &raw.values {
            TimeValues::Integers(values) => values.get(k).map(|&value| value as f64),
            TimeValues::Floats(values) => values.get(k).copied(),
        };
        let value = value.filter(|value| value.is_finite());
        let value = value.ok_or_else(|| NoTimes::NotFinite { field: raw.field.clone() })?;
        counted = (counted.0.min(value), counted.1.max(value));
    }
    if counted.0 > counted.1 { Err(NoTimes::NoReturns) } else { Ok(counted) }
}

/// Times in nanoseconds, to the nearest one that the numbers can tell.
fn nanoseconds(values: &TimeValues, unit: TimeUnit) -> Vec<i64> {
    let factor = unit.nanoseconds();
    match values {
        TimeValues::Integers(values) => values.iter().map(|value| value.saturating_mul(factor)).collect(),
        // Of a time since 1970 in seconds, the product would lose a digit that the number has.
        TimeValues::Floats(values) => values
            .iter()
            .map(|value| {
                let whole = value.trunc();
                let rest_ns = ((value - whole) * factor as f64).round();
                (whole as i64).saturating_mul(factor).saturating_add(rest_ns as i64)
            })
            .collect(),
    }
}

/// Share of the returns that are older than the one before them of the same laser.
fn descents(cloud: &Cloud, times_ns: &[i64]) -> f64 {
    let (mut last, mut returns, mut descents) = (BTreeMap::new(), 0usize, 0usize);
    for ((point, ring), &time) in cloud.points.iter().zip(&cloud.rings).zip(times_ns) {
        if is_return(point) {
            returns += 1;
            let before = last.insert(*ring, time);
            descents += usize::from(before.is_some_and(|before| time < before));
        }
    }
    descents as f64 / returns.max(1) as f64
}
