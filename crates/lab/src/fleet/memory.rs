//! Memory of a process, and its trend.

use super::error::FleetError;

/// Resident memory of a process, bytes, as Linux reports it.
pub(crate) fn resident_bytes(pid: u32) -> Result<u64, FleetError> {
    let path = format!("/proc/{pid}/status");
    let status = std::fs::read_to_string(&path)
        .map_err(|error| FleetError::failed(format!("{path} does not tell the server's memory: {error}")))?;
    let kib =
        status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.strip_suffix("kB")?.trim().parse().ok());
    let kib: u64 = kib.ok_or_else(|| FleetError::failed(format!("{path} has no VmRSS")))?;
    Ok(kib << 10)
}

/// A line through measurements, by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trend {
    /// The mean of all measurements.
    pub(crate) mean: f64,
    /// Slope of the line, per second.
    pub(crate) slope: f64,
}

impl Trend {
    /// The line through measurements (seconds, value); none where there are fewer than two moments.
    pub(crate) fn of(measured: &[(f64, f64)]) -> Option<Self> {
        let count = measured.len() as f64;
        let mean_of = |value: fn(&(f64, f64)) -> f64| measured.iter().map(value).sum::<f64>() / count;
        let (mean_s, mean) = (mean_of(|m| m.0), mean_of(|m| m.1));
        let spread: f64 = measured.iter().map(|(s, _)| (s - mean_s).powi(2)).sum();
        let together: f64 = measured.iter().map(|(s, value)| (s - mean_s) * (value - mean)).sum();
        (spread > 0.0).then(|| Self { mean, slope: together / spread })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_has_memory() {
        assert!(resident_bytes(std::process::id()).unwrap() > 100 << 10);
        assert!(resident_bytes(u32::MAX).is_err());
    }

    #[test]
    fn a_trend_is_a_mean_and_a_slope() {
        let noisy =
            |i: u32| (f64::from(i), 5.0 + 0.25 * f64::from(i) + if i.is_multiple_of(2) { 1.0 } else { -1.0 });
        let trend = Trend::of(&(0..1000).map(noisy).collect::<Vec<_>>()).unwrap();
        assert!((trend.slope - 0.25).abs() < 1e-4 && (trend.mean - 129.875).abs() < 1e-9, "{trend:?}");
        assert_eq!(Trend::of(&[(1.0, 2.0)]), None);
    }
}
