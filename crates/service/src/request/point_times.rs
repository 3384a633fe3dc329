//! Times of a scan's points.

use std::sync::Arc;

use crate::error::{Reason, ServiceError};

/// When the points of a scan were measured, seconds from the scan's timestamp, one for each.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTimes(Arc<[f32]>);

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
    /// Times in seconds, as `reference` says.
    pub fn new(times_s: &[f32], reference: TimeReference) -> Self {
        let at_timestamp_s = match reference {
            TimeReference::Timestamp => 0.0,
            TimeReference::SweepStart => times_s.iter().copied().fold(f32::NEG_INFINITY, f32::max),
        };
        Self(times_s.iter().map(|time_s| time_s - at_timestamp_s).collect())
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

    /// Seconds from the scan's timestamp.
    pub fn as_slice(&self) -> &[f32] {
        &self.0
    }

    /// The times as little-endian f32.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|time_s| time_s.to_le_bytes()).collect()
    }

    /// Asks whether these are times of `points` points of a scan.
    ///
    /// # Errors
    /// When there are more or less of them, one is not finite or farther from the timestamp than `most_s` seconds, or
    /// the scan has no timestamp.
    pub(crate) fn check(
        &self,
        points: usize,
        timestamp_ns: Option<i64>,
        most_s: f64,
    ) -> Result<(), ServiceError> {
        let refuse = |message: String| Err(ServiceError::new(Reason::BadPointTimes, message));
        if self.0.len() != points {
            return refuse(format!(
                "point_times must be one for each of {points} points, got {}",
                self.0.len()
            ));
        }
        if timestamp_ns.is_none() {
            return refuse("point_times count from timestamp_ns, which the scan lacks".into());
        }
        let is_far = |time_s: &f32| !(-most_s..=most_s).contains(&f64::from(*time_s));
        match self.0.iter().position(is_far) {
            None => Ok(()),
            Some(at) => refuse(format!(
                "point_times[{at}] must lie within point_times_max_s, {most_s} s, of timestamp_ns, got {} s",
                self.0[at]
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_from_the_beginning_of_a_sweep_end_at_its_timestamp() {
        let bytes: Vec<u8> = [0.0f32, 0.05, 0.1].iter().flat_map(|time| time.to_le_bytes()).collect();
        let times = PointTimes::from_bytes(&bytes, TimeReference::SweepStart).unwrap();
        assert_eq!(times.as_slice(), [-0.1, -0.05, 0.0]);
        assert_eq!(PointTimes::from_bytes(&times.to_bytes(), TimeReference::Timestamp), Ok(times));
    }

    #[test]
    fn what_is_no_time_is_named_with_its_place_and_the_limit() {
        let refused = |times: &[f32], timestamp| {
            PointTimes::new(times, TimeReference::Timestamp).check(2, timestamp, 1.0).unwrap_err().message
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
