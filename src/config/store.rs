//! Section `store` of the settings.

use std::time::Duration;

use crate::json::ByKeyword;
use mrol_map::map::{KeptPoses, TrajectorySpacing};
use mrol_service::section;
use mrol_store::{Durability, StoreMode, StoreSettings};

/// The largest number of seconds and of MiB.
const MANY: u32 = 1 << 20;

section! {
    /// Settings of the store; see [`StoreSettings`].
    pub struct StoreConfig in "store" {
        /// A change is acknowledged when it is synced (`always`); or a sync interval (`200ms`, `1s`; 1 ms to 1 h).
        durability: Durability = StoreSettings::default().durability; none, #[serde(with = "as_text")];
        /// Journal after which a map is written to a snapshot.
        snapshot_journal_mib: u64 = StoreSettings::default().snapshot_journal_bytes >> 20; MiB, from 1, to MANY;
        /// Time after which a map that changed is written to a snapshot.
        snapshot_interval_s: u64 = StoreSettings::default().snapshot_interval.as_secs(); s, from 1, to MANY;
        /// Revisions behind the newest within which scans can be undone, unless `undo_bytes_max` or a full disk ends it
        /// sooner.
        undo_revisions: u64 = StoreSettings::default().undo_revisions; none;
        /// Most bytes of snapshots and journal of a map that are kept for undo alone.
        undo_bytes_max: u64 = StoreSettings::default().undo_bytes_max; bytes;
        /// Most bytes of a map's last changes that are kept in memory for those who watch it.
        watch_bytes_max: usize = StoreSettings::default().watch_bytes_max; bytes;
        /// Permissions of the folders that the server makes in the data folder, in octal; files have the same but for
        /// execution.
        mode: StoreMode = StoreSettings::default().mode; none, #[serde(with = "as_text")];
        /// Poses that undo reaches no more: keep those that lie apart (`spaced`), or every one (`all`).
        keep_trajectory: ByKeyword<KeptPoses> = ByKeyword::default(); none;
        /// Distance between old poses that are kept.
        trajectory_spacing_m: f64 = StoreSettings::default().trajectory_spacing.distance_m; m, from 0.01, to 1000;
        /// Rotation between them.
        trajectory_spacing_deg: f64 = StoreSettings::default().trajectory_spacing.rotation_deg; deg, from 0.1, to 360;
        /// Time between them.
        trajectory_spacing_s: f64 = StoreSettings::default().trajectory_spacing.seconds; s, from 0.1, to 1_000_000;
    }
}

impl StoreConfig {
    pub(super) fn of_store(&self) -> StoreSettings {
        StoreSettings {
            durability: self.durability,
            snapshot_journal_bytes: self.snapshot_journal_mib << 20,
            snapshot_interval: Duration::from_secs(self.snapshot_interval_s),
            undo_revisions: self.undo_revisions,
            undo_bytes_max: self.undo_bytes_max,
            watch_bytes_max: self.watch_bytes_max,
            mode: self.mode,
            trajectory_spacing: TrajectorySpacing {
                keep: self.keep_trajectory.0,
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
