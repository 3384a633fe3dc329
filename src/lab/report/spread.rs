//! The spread of some runs, as a box with whiskers shows it.

/// Quartiles, the furthest runs that are no outliers, and those that are: further from the box than one and a half
/// times its length.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// The least run that is no outlier.
    pub low: f64,
    /// A quarter of the runs, half of them and three quarters lie below these.
    pub quartiles: [f64; 3],
    /// The greatest run that is no outlier.
    pub high: f64,
    /// Runs further from the box than the whiskers reach, ascending.
    pub outliers: Vec<f64>,
}

const WHISKER: f64 = 1.5;

impl Spread {
    /// The spread of `runs`, in any order; none without a run.
    pub fn of(runs: &[f64]) -> Option<Self> {
        let mut sorted = runs.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.first()?;
        let quartiles = [0.25, 0.5, 0.75].map(|share| quantile(&sorted, share));
        let reach = WHISKER * (quartiles[2] - quartiles[0]);
        let near = quartiles[0] - reach..=quartiles[2] + reach;
        let (inner, outliers): (Vec<_>, Vec<_>) = sorted.into_iter().partition(|run| near.contains(run));
        Some(Self { low: *inner.first()?, quartiles, high: *inner.last()?, outliers })
    }
}

/// The value below which `share` of the sorted values lie, between two of them where need be.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whiskers_end_at_runs_and_outliers_stand_alone() {
        let spread = Spread::of(&[5.0, 1.0, 2.0, 3.0, 4.0, 50.0]).unwrap();
        assert_eq!((spread.low, spread.quartiles, spread.high), (1.0, [2.25, 3.5, 4.75], 5.0));
        assert_eq!(spread.outliers, [50.0]);
    }

    #[test]
    fn one_run_is_its_own_box() {
        let spread = Spread::of(&[2.0]).unwrap();
        assert_eq!((spread.low, spread.quartiles, spread.high), (2.0, [2.0; 3], 2.0));
        assert_eq!(Spread::of(&[]), None);
    }
}
