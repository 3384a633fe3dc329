//! How maps are kept.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::store::{Durability, StoreMode, StoreSettings};

/// How maps are kept; see [`StoreSettings`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StoreConfig {
    /// `always`: what is acknowledged is synced; or an interval (`200ms`, `1s`) at which it is. `always`.
    #[serde(with = "as_text")]
    pub durability: Durability,
    /// MiB of journal after which a map is written to a snapshot. 32.
    pub snapshot_journal_mib: u64,
    /// Seconds after which a map that changed is written to a snapshot. 300.
    pub snapshot_interval_s: u64,
    /// Revisions behind the newest within which a scan can be undone, at least. 20,000.
    pub undo_revisions: u64,
    /// Bytes of snapshots and journal that are kept for undo alone, at most. 4 GiB.
    pub undo_bytes_max: u64,
    /// Permissions of the folders that the server makes in the data folder, in octal; files have the same but for
    /// execution. `0700`.
    #[serde(with = "as_text")]
    pub mode: StoreMode,
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
            mode: store.mode,
        }
    }
}

impl StoreConfig {
    pub(super) fn settings(&self) -> StoreSettings {
        StoreSettings {
            durability: self.durability,
            snapshot_journal_bytes: self.snapshot_journal_mib << 20,
            snapshot_interval: Duration::from_secs(self.snapshot_interval_s),
            undo_revisions: self.undo_revisions,
            undo_bytes_max: self.undo_bytes_max,
            mode: self.mode,
            ..StoreSettings::default()
        }
    }
}

/// Values that are written as text.
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
