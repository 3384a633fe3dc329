//! Check whether the filters are ample: the expected number of wrong answers in a run.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::console::count;

/// Expected false positives, summed over scans.
///
/// Every look-up is counted as one of an absent voxel, at the rate of the worst level: an upper bound. Below
/// one, the filters are ample, and the poses are those of the exact sets (paper IV-B).
#[derive(Debug, Default)]
pub struct FalsePositives {
    lookups: u64,
    expected: f64,
}

impl FalsePositives {
    /// Adds the look-ups of one alignment, made at the false positive rate `rate`.
    pub fn add(&mut self, lookups: u64, rate: f64) {
        self.lookups += lookups;
        self.expected += lookups as f64 * rate;
    }

    /// The summary of the run; `rate` is the false positive rate at its end.
    pub fn summary(&self, rate: f64) -> FilterSummary {
        FilterSummary {
            lookups: self.lookups,
            expected_false_positive_rate: rate,
            expected_false_positives: self.expected,
            ample: self.expected < 1.0,
        }
    }
}

/// Summary of the false positives of a run; see [`FalsePositives`].
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FilterSummary {
    /// Look-ups of all scans.
    pub lookups: u64,
    /// The false positive rate at the end of the run.
    pub expected_false_positive_rate: f64,
    /// Wrong answers of the run, at most.
    pub expected_false_positives: f64,
    /// Fewer than one wrong answer is expected.
    pub ample: bool,
}

impl Display for FilterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "filters: {} look-ups, expected false positive rate {:.3e}, at most {:.3e} false positives expected: ",
            count(self.lookups as usize),
            self.expected_false_positive_rate,
            self.expected_false_positives
        )?;
        match self.ample {
            true => write!(f, "ample (below 1), the poses are those of the exact sets"),
            false => write!(f, "not ample (below 1); more --filter-hashes and --filter-bits-per-key are"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_ample_below_one_expected_false_positive() {
        let mut run = FalsePositives::default();
        run.add(1_000_000, 4e-7);
        assert!(run.summary(4e-7).ample);
        run.add(1_000_000, 7e-7);
        let summary = run.summary(7e-7);
        assert!(!summary.ample && summary.lookups == 2_000_000);
        assert!((summary.expected_false_positives - 1.1).abs() < 1e-9);
    }
}
