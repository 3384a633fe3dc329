//! Section `store` of the settings.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::error::ConfigError;
use mrol_map::map::TrajectorySpacing;
use mrol_store::{Durability, StoreMode, StoreSettings};

/// Settings of the store; see [`StoreSettings`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StoreConfig {
    /// When a change is acknowledged: `always`, once it is synced; or an interval (`200ms`, `1s`) at which the journal
    /// is synced. `always`.
    #[serde(with = "as_text")]
    pub durability: Durability,
    /// Size of a map's journal, MiB, from which on a snapshot is written. 32.
    pub snapshot_journal_mib: u64,
    /// Seconds after which a snapshot of a changed map is written. 300.
    pub snapshot_interval_s: u64,
    /// Least number of revisions within which a scan can be undone. 20,000.
    pub undo_revisions: u64,
    /// Most bytes of snapshots and journal that are kept for undo alone. 4 GiB.
    pub undo_bytes_max: u64,
    /// Bytes of each map's last changes that are kept in memory for who watches it. 16 MiB.
    pub watch_bytes_max: usize,
    /// Permissions of the folders that the server makes in the data folder, in octal; files have the same but for
    /// execution. `0700`.
    #[serde(with = "as_text")]
    pub mode: StoreMode,
    /// Distance between kept poses, meters; see [`TrajectorySpacing::distance_m`]. 0.5.
    pub trajectory_spacing_m: f64,
    /// Rotation between kept poses, degrees; see [`TrajectorySpacing::rotation_deg`]. 10.
    pub trajectory_spacing_deg: f64,
    /// Time between kept poses, seconds; see [`TrajectorySpacing::seconds`]. 60.
    pub trajectory_spacing_s: f64,
}

impl Default for StoreConfig {
    fn default() -> Self {
        let store = StoreSettings::default();
        Self {
            durability: store.durability,
            snapshot_journal_mib: store.snapshot_journal_bytes >> 20,
            snapshot_interval_s: store.snapshot_interval.as_secs(),
            undo_revisions: store.undo_revisions,
            undo_bytes_max: store.undo_bytes_max,
            watch_bytes_max: store.watch_bytes_max,
            mode: store.mode,
            trajectory_spacing_m: store.trajectory_spacing.distance_m,
            trajectory_spacing_deg: store.trajectory_spacing.rotation_deg,
            trajectory_spacing_s: store.trajectory_spacing.seconds,
        }
    }
}

impl StoreConfig {
    /// Refuses a spacing that is negative or not finite.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        for (key, value, range, least, most) in [
            ("store.trajectory_spacing_m", self.trajectory_spacing_m, "0.01 to 1000", 0.01, 1000.0),
            ("store.trajectory_spacing_deg", self.trajectory_spacing_deg, "0.1 to 360", 0.1, 360.0),
            ("store.trajectory_spacing_s", self.trajectory_spacing_s, "0.1 to 1000000", 0.1, 1e6),
        ] {
            if !(least..=most).contains(&value) {
                return Err(ConfigError::Range { key, range, value: value.to_string() });
            }
        }
        Ok(())
    }

    pub(super) fn settings(&self) -> StoreSettings {
        StoreSettings {
            durability: self.durability,
            snapshot_journal_bytes: self.snapshot_journal_mib << 20,
            snapshot_interval: Duration::from_secs(self.snapshot_interval_s),
            undo_revisions: self.undo_revisions,
            undo_bytes_max: self.undo_bytes_max,
            watch_bytes_max: self.watch_bytes_max,
            mode: self.mode,
            trajectory_spacing: TrajectorySpacing {
                distance_m: self.trajectory_spacing_m,
                rotation_deg: self.trajectory_spacing_deg,
                seconds: self.trajectory_spacing_s,
            },
            ..StoreSettings::default()
        }
    }
}

/// Serialization of values by their text form.
mod as_text {
    use std::fmt::Display;
    use std::str::FromStr;

    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &impl Display, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(value)
    }

    pub(super) fn deserialize<'de, D, T>(deserializer: D) -> Result<T, D::Error>
    where
        D: Deserializer<'de>,
        T: FromStr<Err: Display>,
    {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}
