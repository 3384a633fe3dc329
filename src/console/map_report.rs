//! Output of a map's description: the same object as over HTTP, or a table.

use std::fmt;
use std::fmt::Display;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use indicatif::{BinaryBytes, HumanCount};
use serde::Serialize;

use crate::json::{JsonFilter, JsonFilterInfo, JsonLevel, JsonMap, JsonSighting, JsonStorage, JsonVersion};
use mrol_service::MapInfo;

/// A map's description, to be printed.
#[derive(Serialize)]
#[serde(transparent)]
pub struct MapReport(JsonMap);

impl MapReport {
    /// A map in one line of a list.
    pub fn line(info: &MapInfo) -> String {
        let voxels = info.levels.first().map_or(0, |level| level.voxels);
        format!(
            "{:<24} {:>9} m {:>3} levels {:>14} voxels {:>8} scans   revision {}{}",
            info.name.as_str(),
            info.settings.resolution_m,
            info.settings.levels,
            count(voxels),
            count(info.scans),
            info.version.revision,
            if info.is_asleep { "   asleep" } else { "" },
        )
    }

    /// The map's name.
    pub fn name(&self) -> &str {
        &self.0.map
    }

    /// Voxels, levels and uuid of the map, in words.
    pub fn kind(&self) -> String {
        let JsonMap { settings, version, .. } = &self.0;
        let (side, levels) = (settings.resolution_m, settings.levels);
        format!("voxels of {side} m, {levels} levels, uuid {}", version.map_uuid)
    }
}

impl From<&MapInfo> for MapReport {
    fn from(info: &MapInfo) -> Self {
        Self(info.clone().into())
    }
}

impl Display for MapReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(map) = self;
        let JsonVersion { revision, map_uuid, content_hash } = &map.version;
        let hash = content_hash.as_deref().unwrap_or("unknown");
        writeln!(f, "map {} at revision {revision}, uuid {map_uuid}, content hash {hash}", map.map)?;
        let robots = if map.robots.is_empty() { "nobody".into() } else { map.robots.join(", ") };
        let moments = if map.settings.moments { bytes(map.moment_bytes) } else { "none kept".into() };
        let sets = bytes(map.set_bytes);
        let (scans, trajectory) = (count(map.scans), bytes(map.trajectory_bytes));
        let thinned =
            if map.poses < map.scans { format!(" ({} poses kept)", count(map.poses)) } else { String::new() };
        let (viewpoints, seen) = (count(map.viewpoints), bytes(map.viewpoint_bytes));
        write!(
            f,
            "{scans} scans{thinned} from {robots}; exact sets {sets}, moments {moments}, trajectory {trajectory}, "
        )?;
        writeln!(f, "{viewpoints} viewpoints {seen}")?;
        if let Some([x, y, z]) = map.settings.origin_m {
            writeln!(
                f,
                "origin at {x} {y} {z} m of the survey: places there are those of the map plus these"
            )?;
        }
        map.sightings.iter().try_for_each(|sighting| write_sighting(f, sighting))?;
        match &map.storage {
            Some(storage) => write_storage(f, storage)?,
            None => writeln!(f, "in memory only: it ends with the server")?,
        }
        match &map.settings.filter {
            Some(JsonFilter { hashes, bits_per_key }) => {
                writeln!(f, "filters of {hashes} hashes, {bits_per_key} bits a voxel at least\n")?;
                write!(
                    f,
                    "level  resolution          voxels   filter plane      counters   false positives:"
                )?;
                write!(f, " expected   eq. (1)   measured")?;
            }
            None => write!(f, "no filters\n\nlevel  resolution          voxels")?,
        }
        map.levels.iter().try_for_each(|level| write_level(f, level))
    }
}

fn write_sighting(f: &mut fmt::Formatter<'_>, sighting: &JsonSighting) -> fmt::Result {
    let JsonSighting { robot, seen_at_ns, map_from_sensor, verdict, stationary, .. } = sighting;
    let seen_at = UNIX_EPOCH + Duration::from_nanos(u64::try_from(*seen_at_ns).unwrap_or(0));
    let ago = SystemTime::now().duration_since(seen_at).unwrap_or_default().as_secs_f64();
    let [x, y, z] = map_from_sensor.translation_m;
    let standing = if *stationary { ", standing still" } else { "" };
    writeln!(f, "{robot} was seen {ago:.1} s ago at {x:.2} {y:.2} {z:.2} m: {verdict}{standing}")
}

fn write_storage(f: &mut fmt::Formatter<'_>, storage: &JsonStorage) -> fmt::Result {
    let JsonStorage { durable_revision, snapshot_revision, undo_from_revision, read_only } = storage;
    write!(f, "synced up to revision {durable_revision}, snapshot at {snapshot_revision}; ")?;
    writeln!(f, "scans from revision {undo_from_revision} on can be undone")?;
    read_only.iter().try_for_each(|reason| writeln!(f, "READ ONLY since its journal failed: {reason}"))
}

fn write_level(f: &mut fmt::Formatter<'_>, level: &JsonLevel) -> fmt::Result {
    let JsonLevel { level, resolution_m, voxels, filter } = level;
    write!(f, "\n{level:>5} {resolution_m:>9} m {:>15}", count(*voxels))?;
    filter.iter().try_for_each(|filter| write_filter(f, filter))
}

fn write_filter(f: &mut fmt::Formatter<'_>, filter: &JsonFilterInfo) -> fmt::Result {
    let measured = filter.measured_false_positive_rate.map_or("-".into(), percent);
    write!(
        f,
        " {:>14} {:>13} {:>26} {:>9} {measured:>10}",
        bytes(filter.plane_bytes),
        bytes(filter.counter_bytes),
        percent(filter.expected_false_positive_rate),
        percent(filter.ideal_false_positive_rate),
    )
}

/// Formats a count: `1,234,567`.
pub fn count(n: usize) -> String {
    HumanCount(n as u64).to_string()
}

/// Formats a size: `1.23 MiB`.
pub fn bytes(n: usize) -> String {
    BinaryBytes(n as u64).to_string()
}

/// Formats a share: `2.10 %`.
pub fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}
