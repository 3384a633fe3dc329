//! Settings of the store.

use std::fmt::{self, Display};
use std::str::FromStr;
use std::time::Duration;

use super::mode::StoreMode;
use mrol_map::map::TrajectorySpacing;

/// When a change may be acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// A change is acknowledged when it is synced: what was acknowledged survives the loss of power.
    #[default]
    Always,
    /// A change is acknowledged when it is written, and synced at this interval. What was acknowledged survives the end
    /// of the process at any moment; the loss of power takes the last interval.
    Interval(Duration),
}

/// Why a text is not a valid [`Durability`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("must be \"always\" or an interval such as \"200ms\" or \"1s\", from 1ms to 1h, got {0:?}")]
pub struct DurabilityError(String);

impl FromStr for Durability {
    type Err = DurabilityError;

    fn from_str(text: &str) -> Result<Self, DurabilityError> {
        const HOUR: Duration = Duration::from_secs(3600);
        let number = |digits: &str| digits.parse::<u32>().ok();
        let interval = || match text.strip_suffix("ms") {
            Some(digits) => number(digits).map(|ms| Duration::from_millis(ms.into())),
            None => number(text.strip_suffix('s')?).map(|s| Duration::from_secs(s.into())),
        };
        match text {
            "always" => Ok(Self::Always),
            _ => interval()
                .filter(|interval| (Duration::from_millis(1)..=HOUR).contains(interval))
                .map(Self::Interval)
                .ok_or_else(|| DurabilityError(text.chars().take(64).collect())),
        }
    }
}

impl Display for Durability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Always => f.write_str("always"),
            Self::Interval(interval) => write!(f, "{}ms", interval.as_millis()),
        }
    }
}

/// Settings of a store.
#[derive(Debug, Clone, PartialEq)]
pub struct StoreSettings {
    /// When a change may be acknowledged. [`Durability::Always`].
    pub durability: Durability,
    /// Bytes of a map's journal from which on a snapshot is written. 32 MiB.
    pub snapshot_journal_bytes: u64,
    /// Time after which a snapshot of a changed map is written. 5 minutes.
    pub snapshot_interval: Duration,
    /// Least number of revisions within which a scan can be undone; the journal outlives the snapshots that long.
    /// 20,000.
    pub undo_revisions: u64,
    /// Most bytes of snapshots and journal that are kept for undo alone; beyond it undo can go less far back than
    /// `undo_revisions`. 4 GiB, which is 20,000 scans of 200 KiB.
    pub undo_bytes_max: u64,
    /// Permissions of the data folder.
    pub mode: StoreMode,
    /// Spacing of the poses of one robot that are kept beyond the undo window.
    pub trajectory_spacing: TrajectorySpacing,
    /// Size from which on a segment of the journal is ended, bytes. 64 MiB.
    pub segment_bytes_max: u64,
    /// Most bytes of a map's last changes that are kept in memory for its watchers. 16 MiB.
    pub watch_bytes_max: usize,
}

impl Default for StoreSettings {
    fn default() -> Self {
        Self {
            durability: Durability::default(),
            snapshot_journal_bytes: 32 << 20,
            snapshot_interval: Duration::from_secs(300),
            undo_revisions: 20_000,
            undo_bytes_max: 4 << 30,
            mode: StoreMode::default(),
            trajectory_spacing: TrajectorySpacing::default(),
            segment_bytes_max: 64 << 20,
            watch_bytes_max: 16 << 20,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_durability_is_always_or_an_interval() {
        for (text, durability) in [
            ("always", Durability::Always),
            ("200ms", Durability::Interval(Duration::from_millis(200))),
            ("3s", Durability::Interval(Duration::from_secs(3))),
        ] {
            assert_eq!(text.parse(), Ok(durability));
            assert_eq!(durability.to_string().parse(), Ok(durability));
        }
        for bad in ["", "never", "0ms", "2h", "-1s", "3601s", "1.5s", "s", "always "] {
            let error = bad.parse::<Durability>().unwrap_err().to_string();
            assert!(error.contains("always") && error.contains(&format!("{bad:?}")), "{error}");
        }
    }
}
