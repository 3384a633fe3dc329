//! What is printed of a map: the same object as over HTTP, or a table.

use std::fmt::{self, Display};

use indicatif::{BinaryBytes, HumanCount};
use serde::Serialize;

use crate::map::LevelInfo;
use crate::service::{MapInfo, MapStorage};

/// A map's description.
#[derive(Serialize)]
pub(super) struct MapReport {
    map: String,
    revision: u64,
    map_uuid: String,
    settings: Settings,
    levels: Vec<Level>,
    scans: usize,
    robots: Vec<String>,
    set_bytes: usize,
    moment_bytes: usize,
    trajectory_bytes: usize,
    storage: Option<Storage>,
}

/// What lies on disk.
#[derive(Serialize)]
struct Storage {
    durable_revision: u64,
    snapshot_revision: u64,
    undo_from_revision: u64,
    read_only: Option<String>,
}

#[derive(Serialize)]
struct Settings {
    resolution_m: f64,
    levels: u32,
    filter: Filter,
}

#[derive(Serialize)]
struct Filter {
    hashes: u32,
    bits_per_key: f64,
}

#[derive(Serialize)]
struct Level {
    level: u32,
    resolution_m: f64,
    voxels: usize,
    plane_bytes: usize,
    counter_bytes: usize,
    expected_false_positive_rate: f64,
    ideal_false_positive_rate: f64,
    measured_false_positive_rate: Option<f64>,
}

impl MapReport {
    /// A map in one line of a list.
    pub(super) fn line(info: &MapInfo) -> String {
        let voxels = info.levels.first().map_or(0, |level| level.voxels);
        format!(
            "{:<24} {:>9} m {:>3} levels {:>14} voxels {:>8} scans   revision {}",
            info.name.as_str(),
            info.settings.resolution_m,
            info.settings.levels,
            count(voxels),
            count(info.scans),
            info.version.revision,
        )
    }
}

impl From<&MapInfo> for MapReport {
    fn from(info: &MapInfo) -> Self {
        let filter =
            Filter { hashes: info.settings.filter.hashes, bits_per_key: info.settings.filter.bits_per_key };
        let settings =
            Settings { resolution_m: info.settings.resolution_m, levels: info.settings.levels, filter };
        Self {
            map: info.name.to_string(),
            revision: info.version.revision,
            map_uuid: info.version.map_uuid.to_string(),
            settings,
            levels: info.levels.iter().map(Level::from).collect(),
            scans: info.scans,
            robots: info.robots.iter().map(ToString::to_string).collect(),
            set_bytes: info.set_bytes,
            moment_bytes: info.moment_bytes,
            trajectory_bytes: info.trajectory_bytes,
            storage: info.storage.clone().map(Storage::from),
        }
    }
}

impl From<MapStorage> for Storage {
    fn from(storage: MapStorage) -> Self {
        let MapStorage { durable_revision, snapshot_revision, undo_from_revision, failure, .. } = storage;
        Self { durable_revision, snapshot_revision, undo_from_revision, read_only: failure }
    }
}

impl From<&LevelInfo> for Level {
    fn from(info: &LevelInfo) -> Self {
        Self {
            level: info.level,
            resolution_m: info.resolution_m,
            voxels: info.voxels,
            plane_bytes: info.plane_bytes,
            counter_bytes: info.counter_bytes,
            expected_false_positive_rate: info.expected_rate,
            ideal_false_positive_rate: info.ideal_false_positive_rate,
            measured_false_positive_rate: info.measured_rate,
        }
    }
}

impl Display for MapReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "map {} at revision {}, uuid {}", self.map, self.revision, self.map_uuid)?;
        let robots = if self.robots.is_empty() { "nobody".into() } else { self.robots.join(", ") };
        let (sets, moments) = (bytes(self.set_bytes), bytes(self.moment_bytes));
        let (scans, poses) = (count(self.scans), bytes(self.trajectory_bytes));
        writeln!(f, "{scans} scans from {robots}; exact sets {sets}, moments {moments}, trajectory {poses}")?;
        match &self.storage {
            Some(storage) => writeln!(f, "{storage}")?,
            None => writeln!(f, "in memory only: it ends with the server")?,
        }
        let Filter { hashes, bits_per_key } = self.settings.filter;
        writeln!(f, "filters of {hashes} hashes, {bits_per_key} bits a voxel at least\n")?;
        write!(f, "level  resolution          voxels   filter plane      counters   false positives:")?;
        write!(f, " expected   eq. (1)   measured")?;
        self.levels.iter().try_for_each(|level| write!(f, "\n{level}"))
    }
}

impl Display for Storage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { durable_revision, snapshot_revision, undo_from_revision, read_only } = self;
        write!(f, "synced up to revision {durable_revision}, snapshot at {snapshot_revision}; ")?;
        write!(f, "scans from revision {undo_from_revision} on can be undone")?;
        read_only.iter().try_for_each(|reason| write!(f, "\nREAD ONLY since its journal failed: {reason}"))
    }
}

impl Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let measured = self.measured_false_positive_rate.map_or("-".into(), percent);
        write!(
            f,
            "{:>5} {:>9} m {:>15} {:>14} {:>13} {:>26} {:>9} {measured:>10}",
            self.level,
            self.resolution_m,
            count(self.voxels),
            bytes(self.plane_bytes),
            bytes(self.counter_bytes),
            percent(self.expected_false_positive_rate),
            percent(self.ideal_false_positive_rate),
        )
    }
}

/// `1,234,567`.
pub(super) fn count(n: usize) -> String {
    HumanCount(n as u64).to_string()
}

/// `1.23 MiB`.
pub(super) fn bytes(n: usize) -> String {
    BinaryBytes(n as u64).to_string()
}

/// `2.10 %`.
pub(super) fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}
