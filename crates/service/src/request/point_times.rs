//! Times of a scan's points.

use std::sync::Arc;

use crate::error::{Reason, ServiceError};

/// When the points of a scan were measured, seconds, one for each.
///
/// Times of points that are skipped may be anything: drivers leave what was in memory before.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTimes {
    times_s: Arc<[f32]>,
    reference: TimeReference,
}

/// Which moment the timestamp of a sweep is, and from where its points' times count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeReference {
    /// Times count from the timestamp, and are negative before it.
    #[default]
    Timestamp,
    /// Times count from the beginning of the sweep, and the timestamp is its end: the largest time.
    SweepStart,
}

impl PointTimes {
    /// Times in seconds, which count from where `reference` says.
    pub fn new(times_s: &[f32], reference: TimeReference) -> Self {
        Self { times_s: times_s.into(), reference }
    }

    /// Times from little-endian f32.
    ///
    /// # Errors
    /// When the bytes are not a whole number of times.
    pub fn from_bytes(bytes: &[u8], reference: TimeReference) -> Result<Self, ServiceError> {
        let (times, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            let message =
                format!("point_times must be a whole number of little-endian f32, got {} bytes", bytes.len());
            return Err(ServiceError::new(Reason::BadPointTimes, message));
        }
        let times_s: Vec<f32> = times.iter().map(|time| f32::from_le_bytes(*time)).collect();
        Ok(Self::new(&times_s, reference))
    }

    /// The times, seconds from [`PointTimes::reference`].
    pub fn as_slice(&self) -> &[f32] {
        &self.times_s
    }

    /// From where the times count.
    pub fn reference(&self) -> TimeReference {
        self.reference
    }

    /// The times as little-endian f32.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.times_s.iter().flat_map(|time_s| time_s.to_le_bytes()).collect()
    }

    /// Asks whether these are as many times as a scan has `points`, and the scan has a timestamp.
    ///
    /// # Errors
    /// When there are more or less of them, or the scan has no timestamp.
    pub(crate) fn check(&self, points: usize, timestamp_ns: Option<i64>) -> Result<(), ServiceError> {
        let refuse = |message: String| Err(ServiceError::new(Reason::BadPointTimes, message));
        let times = self.times_s.len();
        if times != points {
            return refuse(format!("point_times must be one for each of {points} points, got {times}"));
        }
        if timestamp_ns.is_none() {
            return refuse("point_times count from timestamp_ns, which the scan lacks".into());
        }
        Ok(())
    }

    /// The times from the scan's timestamp. Of points that do not count (`counts` is false of their index) those that
    /// are no times become NaN.
    ///
    /// # Errors
    /// When the time of a point that counts is not finite, or farther from the timestamp than `most_s` seconds.
    pub(crate) fn relative_to_timestamp(
        &self,
        counts: impl Fn(usize) -> bool,
        most_s: f64,
    ) -> Result<Self, ServiceError> {
        let counted = self.times_s.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, time_s)| *time_s);
        let at_timestamp_s = match self.reference {
            TimeReference::Timestamp => 0.0,
            TimeReference::SweepStart => counted.reduce(f32::max).unwrap_or_default(),
        };
        let is_time = |time_s: f32| (-most_s..=most_s).contains(&f64::from(time_s));
        let mut times_s: Vec<f32> = self.times_s.iter().map(|time_s| time_s - at_timestamp_s).collect();
        for (i, time_s) in times_s.iter_mut().enumerate().filter(|(_, time_s)| !is_time(**time_s)) {
            if counts(i) {
                let message = format!(
                    "point_times[{i}] must lie within point_times_max_s, {most_s} s, of timestamp_ns, got {time_s} s; \
                     those of points that are skipped may be anything"
                );
                return Err(ServiceError::new(Reason::BadPointTimes, message));
            }
            *time_s = f32::NAN;
        }
        Ok(Self { times_s: times_s.into(), reference: TimeReference::Timestamp })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_from_the_beginning_of_a_sweep_end_at_its_timestamp() {
        let bytes: Vec<u8> = [0.0f32, 0.05, 0.1].iter().flat_map(|time| time.to_le_bytes()).collect();
        let times = PointTimes::from_bytes(&bytes, TimeReference::SweepStart).unwrap();
        let from_timestamp = times.relative_to_timestamp(|_| true, 1.0).unwrap();
        assert_eq!(from_timestamp.as_slice(), [-0.1, -0.05, 0.0]);
        assert_eq!(PointTimes::from_bytes(&times.to_bytes(), TimeReference::SweepStart), Ok(times));
    }

    #[test]
    fn times_of_points_that_do_not_count_may_be_anything() {
        for wrong in [f32::NAN, f32::INFINITY, f32::MAX, -4e9, 4_294.967] {
            let sweep = PointTimes::new(&[0.0, wrong, 0.1, 0.05], TimeReference::SweepStart);
            let times = sweep.relative_to_timestamp(|i| i != 1, 1.0).unwrap();
            assert_eq!([0, 2, 3].map(|i| times.as_slice()[i]), [-0.1, 0.0, -0.05]);
            assert!(times.as_slice()[1].is_nan());
            assert!(sweep.relative_to_timestamp(|_| true, 1.0).is_err());
        }
        let none =
            PointTimes::new(&[f32::NAN], TimeReference::SweepStart).relative_to_timestamp(|_| false, 1.0);
        assert!(none.unwrap().as_slice()[0].is_nan());
    }

    #[test]
    fn what_is_no_time_is_named_with_its_place_and_the_limit() {
        let refused = |times: &[f32], timestamp| {
            let times = PointTimes::new(times, TimeReference::Timestamp);
            let refused = times
                .check(2, timestamp)
                .and_then(|()| times.relative_to_timestamp(|_| true, 1.0).map(|_| ()));
            refused.unwrap_err().message
        };
        assert!(refused(&[0.0], Some(1)).contains("each of 2 points, got 1"));
        assert!(refused(&[0.0, 0.0], None).contains("timestamp_ns"));
        for (bad, said) in [(f32::NAN, "NaN"), (1.5, "1.5 s"), (f32::NEG_INFINITY, "-inf"), (-1.1, "-1.1 s")]
        {
            let message = refused(&[0.0, bad], Some(1));
            assert!(message.contains("point_times[1]") && message.contains(said), "{message}");
        }
        assert!(PointTimes::from_bytes(&[0; 7], TimeReference::Timestamp).is_err());
    }
}
