//! Statistics of a series of errors.

use serde::Serialize;

/// Maximum, median and root mean square of a series of errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// The maximum.
    pub max: f64,
    /// The median.
    pub median: f64,
    /// The root mean square.
    pub rms: f64,
}

impl Statistics {
    /// The statistics of `errors`; none of an empty series.
    pub fn of(mut errors: Vec<f64>) -> Option<Self> {
        errors.sort_unstable_by(f64::total_cmp);
        let (max, middle, n) = (*errors.last()?, errors.len() / 2, errors.len());
        let median = if n % 2 == 1 { errors[middle] } else { (errors[middle - 1] + errors[middle]) / 2.0 };
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
        Some(Self { max, median, rms })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_has_a_largest_a_middle_and_a_mean() {
        let three = Statistics::of(vec![3.0, 0.0, 4.0]).unwrap();
        assert_eq!((three.max, three.median), (4.0, 3.0));
        assert!((three.rms - (25.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(Statistics::of(vec![1.0, 2.0]).unwrap().median, 1.5);
        assert_eq!(Statistics::of(vec![]), None);
    }
}
