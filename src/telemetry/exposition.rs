//! The gauges of the maps, written afresh at each scrape in Prometheus' text form:
//! `name{label="value",...} number`.

use std::fmt::{Display, Write};

use crate::map::LevelInfo;
use crate::service::{MapInfo, MapStorage, PoolUse};

/// Appends the gauges of `pools`.
pub(super) fn write_pools(text: &mut String, pools: &[PoolUse]) {
    type Value = fn(&PoolUse) -> u64;
    let families: [(&'static str, &str, Value); 4] = [
        ("mrol_jobs_waiting", "Jobs that wait for a thread, by pool", |pool| pool.waiting as u64),
        ("mrol_jobs_running", "Jobs in hand, by pool", |pool| pool.running as u64),
        ("mrol_jobs_begun", "Jobs that were taken in hand since the start, by pool", |pool| pool.begun),
        (
            "mrol_jobs_given_up",
            "Jobs whose callers went before the answer since the start, by pool",
            |pool| pool.given_up,
        ),
    ];
    for (name, what, value) in families {
        let mut family = Family::begin(text, name, what);
        for pool in pools {
            family.gauge(&[("pool", &pool.name)], value(pool));
        }
    }
}

/// Appends the gauges of `maps`.
pub(super) fn write_maps(text: &mut String, maps: &[MapInfo]) {
    let mut family = Family::begin(text, "mrol_map_voxels", "Occupied voxels, by map and level");
    for (map, level) in levels(maps) {
        family.gauge(&[("map", &map.name), ("level", &level.level)], level.voxels);
    }
    let mut family =
        Family::begin(text, "mrol_map_set_bytes", "Bytes of the exact sets of all levels, by map");
    for map in maps {
        family.gauge(&[("map", &map.name)], map.set_bytes);
    }
    let mut family = Family::begin(text, "mrol_map_moment_bytes", "Bytes of the points' moments, by map");
    for map in maps {
        family.gauge(&[("map", &map.name)], map.moment_bytes);
    }
    let mut family = Family::begin(text, "mrol_map_trajectory_bytes", "Bytes of the trajectory, by map");
    for map in maps {
        family.gauge(&[("map", &map.name)], map.trajectory_bytes);
    }
    write_filters(text, maps);
    let mut family = Family::begin(text, "mrol_map_revision", "Committed changes, by map");
    for map in maps {
        family.gauge(&[("map", &map.name)], map.state.revision);
    }
    let mut family = Family::begin(text, "mrol_map_scans", "Accepted scans whose poses are kept, by map");
    for map in maps {
        family.gauge(&[("map", &map.name)], map.scans);
    }
    write_storage(text, maps);
}

fn write_filters(text: &mut String, maps: &[MapInfo]) {
    let what = "Bytes of the filters, by map, level and part: the plane that look-ups read, the counters";
    let mut family = Family::begin(text, "mrol_map_filter_bytes", what);
    for (map, level) in levels(maps) {
        for (part, bytes) in [("plane", level.plane_bytes), ("counters", level.counter_bytes)] {
            family.gauge(&[("map", &map.name), ("level", &level.level), ("part", &part)], bytes);
        }
    }
    let what = "False positive rate of the filters, by map, level and kind: by the closed form of their layout, \
                by eq. (1) of the paper, as measured now";
    let mut family = Family::begin(text, "mrol_filter_false_positive_rate", what);
    for (map, level) in levels(maps) {
        let rates = [
            ("expected", Some(level.expected_rate)),
            ("equation_1", Some(level.unblocked_rate)),
            ("measured", level.measured_rate),
        ];
        for (kind, rate) in rates {
            if let Some(rate) = rate {
                family.gauge(&[("map", &map.name), ("level", &level.level), ("kind", &kind)], rate);
            }
        }
    }
}

fn levels(maps: &[MapInfo]) -> impl Iterator<Item = (&MapInfo, &LevelInfo)> {
    maps.iter().flat_map(|map| map.levels.iter().map(move |level| (map, level)))
}

/// What keeps the maps: how far it is, and what it took.
fn write_storage(text: &mut String, maps: &[MapInfo]) {
    let kept = || maps.iter().filter_map(|map| Some((&map.name, map.storage.as_ref()?)));
    type Value = fn(&MapStorage) -> f64;
    let families: [(&'static str, &str, Value); 7] = [
        ("mrol_map_durable_revision", "Last revision known to be synced, by map", |s| {
            s.durable_revision as f64
        }),
        ("mrol_map_snapshot_revision", "Revision of the newest snapshot, by map", |s| {
            s.snapshot_revision as f64
        }),
        ("mrol_map_read_only", "1 where the journal failed and the map takes no changes, by map", |s| {
            f64::from(u8::from(s.failure.is_some()))
        }),
        ("mrol_journal_records", "Records appended since the start, by map", |s| s.journal.records as f64),
        ("mrol_journal_bytes", "Bytes appended since the start, by map", |s| s.journal.bytes as f64),
        ("mrol_journal_syncs", "Syncs since the start, by map", |s| s.journal.syncs as f64),
        ("mrol_journal_sync_seconds", "Seconds spent in syncs since the start, by map", |s| {
            s.journal.sync_time.as_secs_f64()
        }),
    ];
    for (name, what, value) in families {
        let mut family = Family::begin(text, name, what);
        for (map, storage) in kept() {
            family.gauge(&[("map", map)], value(storage));
        }
    }
}

/// One metric name with its samples.
struct Family<'a> {
    text: &'a mut String,
    name: &'static str,
}

impl<'a> Family<'a> {
    fn begin(text: &'a mut String, name: &'static str, what: &str) -> Self {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(text, "# HELP {name} {what}\n# TYPE {name} gauge");
        Self { text, name }
    }

    /// One sample. No label value needs escaping: names of maps hold neither quotes nor backslashes.
    fn gauge(&mut self, labels: &[(&str, &dyn Display)], value: impl Display) {
        let _ = write!(self.text, "{}", self.name);
        for (i, (label, value)) in labels.iter().enumerate() {
            let _ = write!(self.text, "{}{label}=\"{value}\"", if i == 0 { '{' } else { ',' });
        }
        let _ = writeln!(self.text, "}} {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_is_help_type_and_samples() {
        let mut text = String::new();
        Family::begin(&mut text, "m", "What it is").gauge(&[("map", &"a"), ("level", &2)], 0.5);
        assert_eq!(text, "# HELP m What it is\n# TYPE m gauge\nm{map=\"a\",level=\"2\"} 0.5\n");
    }
}
