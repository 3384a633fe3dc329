//! Statistics of a box plot.

/// The spread of some runs: quartiles, whiskers and outliers. Outliers are further from the box than one and a half
/// times its length.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// End of the lower whisker: the least run that is no outlier.
    pub low: f64,
    /// The quartiles: a quarter of the runs, half of them and three quarters lie below these.
    pub quartiles: [f64; 3],
    /// End of the upper whisker: the greatest run that is no outlier.
    pub high: f64,
    /// Runs beyond the whiskers, ascending.
    pub outliers: Vec<f64>,
}

const WHISKER: f64 = 1.5;

impl Spread {
    /// Computes the spread of `runs`, in any order; none without a run.
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

/// The quantile `share` of ascending values, interpolated between two of them.
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
