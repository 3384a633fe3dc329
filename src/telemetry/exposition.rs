//! What is known of maps and pools, written afresh at each scrape in Prometheus' text form:
//! `name{label="value",...} number`.

use std::collections::BTreeMap;
use std::fmt::{Display, Write};

use super::map_counters;
use super::map_counters::Series;
use mrol_map::map::{FilterInfo, LevelInfo, MapName};
use mrol_map::util::Durations;
use mrol_service::{LaneUse, MapInfo, MapStorage, MapsAwake, UnavailableMap};

/// Appends what was counted by map.
pub(super) fn write_counters(text: &mut String, maps: &[(MapName, BTreeMap<Series, u64>)]) {
    for counted in map_counters::Family::ALL {
        let mut family = Family::begin(text, counted.name(), Kind::Counter, counted.help());
        for (map, counters) in maps {
            for ((_, label), count) in counters.iter().filter(|((family, _), _)| *family == counted) {
                match label {
                    Some((label, value)) => family.sample(&[("map", map), (label, value)], count),
                    None => family.sample(&[("map", map)], count),
                }
            }
        }
    }
}

/// Appends what is known of `lanes`.
pub(super) fn write_lanes(text: &mut String, lanes: &[LaneUse]) {
    type Value = fn(&LaneUse) -> u64;
    let families: [(&'static str, Kind, &str, Value); 4] = [
        ("mrol_jobs_waiting", Kind::Gauge, "Jobs that wait for a thread, by pool", |lane| {
            lane.waiting as u64
        }),
        ("mrol_jobs_running", Kind::Gauge, "Jobs in hand, by pool", |lane| lane.running as u64),
        ("mrol_jobs_begun_total", Kind::Counter, "Jobs that were taken in hand, by pool", |lane| lane.begun),
        (
            "mrol_jobs_cancelled_total",
            Kind::Counter,
            "Jobs whose callers went before the answer, by pool",
            |lane| lane.cancelled,
        ),
    ];
    for (name, kind, what, value) in families {
        let mut family = Family::begin(text, name, kind, what);
        for lane in lanes {
            family.sample(&[("pool", &lane.name)], value(lane));
        }
    }
    let what = "Seconds that jobs waited for a thread, by pool";
    let mut family = Family::begin(text, "mrol_job_wait_seconds", Kind::Histogram, what);
    for lane in lanes {
        family.histogram(&[("pool", &lane.name)], &lane.waits);
    }
}

/// Appends the gauges of `maps`.
pub(super) fn write_maps(text: &mut String, maps: &[MapInfo]) {
    let mut family = Family::begin(text, "mrol_map_voxels", Kind::Gauge, "Occupied voxels, by map and level");
    for (map, level) in levels(maps) {
        family.sample(&[("map", &map.name), ("level", &level.level)], level.voxels);
    }
    let mut family = Family::begin(
        text,
        "mrol_map_set_bytes",
        Kind::Gauge,
        "Bytes of the exact sets of all levels, by map",
    );
    for map in maps {
        family.sample(&[("map", &map.name)], map.set_bytes);
    }
    let mut family =
        Family::begin(text, "mrol_map_moment_bytes", Kind::Gauge, "Bytes of the points' moments, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.moment_bytes);
    }
    let mut family =
        Family::begin(text, "mrol_map_trajectory_bytes", Kind::Gauge, "Bytes of the trajectory, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.trajectory_bytes);
    }
    let mut family = Family::begin(
        text,
        "mrol_map_viewpoint_bytes",
        Kind::Gauge,
        "Bytes of the viewpoints, by which a map knows what is free, by map",
    );
    for map in maps {
        family.sample(&[("map", &map.name)], map.viewpoint_bytes);
    }
    let mut family =
        Family::begin(text, "mrol_map_viewpoints", Kind::Gauge, "Viewpoints that scans left, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.viewpoints);
    }
    write_filters(text, maps);
    let mut family = Family::begin(text, "mrol_map_revision", Kind::Gauge, "Committed changes, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.version.revision);
    }
    let mut family =
        Family::begin(text, "mrol_map_scans", Kind::Gauge, "Scans that were accepted and not undone, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.scans);
    }
    let mut family =
        Family::begin(text, "mrol_map_poses", Kind::Gauge, "Those of them whose poses are kept, by map");
    for map in maps {
        family.sample(&[("map", &map.name)], map.poses);
    }
    write_storage(text, maps);
}

/// Appends how many maps are in memory.
pub(super) fn write_awake(text: &mut String, MapsAwake { awake, asleep, wakes }: MapsAwake) {
    let what = "Maps that are served, by state: in memory, or only on disk until a request opens them";
    let mut family = Family::begin(text, "mrol_maps", Kind::Gauge, what);
    for (state, count) in [("awake", awake), ("asleep", asleep)] {
        family.sample(&[("state", &state)], count);
    }
    let what = "Maps that requests opened after they had left memory";
    Family::begin(text, "mrol_map_wakes_total", Kind::Counter, what).sample(&[], wakes);
}

/// Appends which maps could not be opened.
pub(super) fn write_unavailable(text: &mut String, maps: &[UnavailableMap]) {
    let what = "1 where the map could not be opened, by map";
    let mut family = Family::begin(text, "mrol_map_unavailable", Kind::Gauge, what);
    for map in maps {
        family.sample(&[("map", &map.name)], 1);
    }
}

fn write_filters(text: &mut String, maps: &[MapInfo]) {
    let what = "Bytes of the filters, by map, level and part: the plane that look-ups read, the counters";
    let mut family = Family::begin(text, "mrol_map_filter_bytes", Kind::Gauge, what);
    for (map, level, filter) in filters(maps) {
        for (part, bytes) in [("plane", filter.plane_bytes), ("counters", filter.counter_bytes)] {
            family.sample(&[("map", &map.name), ("level", &level.level), ("part", &part)], bytes);
        }
    }
    let what = "False positive rate of the filters, by map, level and kind: by the closed form of their layout, \
                by eq. (1) of the paper, as measured now";
    let mut family = Family::begin(text, "mrol_filter_false_positive_rate", Kind::Gauge, what);
    for (map, level, filter) in filters(maps) {
        let rates = [
            ("expected", Some(filter.expected_rate)),
            ("ideal", Some(filter.ideal_false_positive_rate)),
            ("measured", filter.measured_rate),
        ];
        for (kind, rate) in rates {
            if let Some(rate) = rate {
                family.sample(&[("map", &map.name), ("level", &level.level), ("kind", &kind)], rate);
            }
        }
    }
}

/// The filters of the levels that have one.
fn filters(maps: &[MapInfo]) -> impl Iterator<Item = (&MapInfo, &LevelInfo, FilterInfo)> {
    levels(maps).filter_map(|(map, level)| Some((map, level, level.filter?)))
}

fn levels(maps: &[MapInfo]) -> impl Iterator<Item = (&MapInfo, &LevelInfo)> {
    maps.iter().flat_map(|map| map.levels.iter().map(move |level| (map, level)))
}

/// What keeps the maps: how far it is, and what it took.
fn write_storage(text: &mut String, maps: &[MapInfo]) {
    let kept = || maps.iter().filter_map(|map| Some((&map.name, map.storage.as_ref()?)));
    type Value = fn(&MapStorage) -> f64;
    let families: [(&'static str, Kind, &str, Value); 8] = [
        ("mrol_map_durable_revision", Kind::Gauge, "Last revision known to be synced, by map", |s| {
            s.durable_revision as f64
        }),
        ("mrol_map_snapshot_revision", Kind::Gauge, "Revision of the newest snapshot, by map", |s| {
            s.snapshot_revision as f64
        }),
        (
            "mrol_map_snapshot_age_seconds",
            Kind::Gauge,
            "Seconds since the newest snapshot was written, or since the start where that was later, by map",
            |s| s.snapshot_age.as_secs_f64(),
        ),
        (
            "mrol_map_snapshot_failures_total",
            Kind::Counter,
            "Snapshots that could not be written, by map",
            |s| s.snapshot_failures as f64,
        ),
        ("mrol_map_disk_bytes", Kind::Gauge, "Bytes on disk: snapshots and journal, by map", |s| {
            s.disk_bytes as f64
        }),
        (
            "mrol_map_read_only",
            Kind::Gauge,
            "1 where the map takes no changes since the journal failed, or histories differ, by map",
            |s| f64::from(u8::from(s.failure.is_some())),
        ),
        ("mrol_journal_records_total", Kind::Counter, "Records appended, by map", |s| {
            s.journal.records as f64
        }),
        ("mrol_journal_bytes_total", Kind::Counter, "Bytes appended, by map", |s| s.journal.bytes as f64),
    ];
    for (name, kind, what, value) in families {
        let mut family = Family::begin(text, name, kind, what);
        for (map, storage) in kept() {
            family.sample(&[("map", map)], value(storage));
        }
    }
    let what = "Seconds that syncs of the journal took, by map";
    let mut family = Family::begin(text, "mrol_journal_sync_seconds", Kind::Histogram, what);
    for (map, storage) in kept() {
        family.histogram(&[("map", map)], &storage.journal.syncs);
    }
    let what = "Seconds from a group of changes in hand to durable and visible, by map";
    let mut family = Family::begin(text, "mrol_commit_seconds", Kind::Histogram, what);
    for map in maps {
        family.histogram(&[("map", &map.name)], &map.commits);
    }
}

/// What Prometheus makes of a family.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    /// Goes up and down.
    Gauge,
    /// Counts since the start; its name ends with `_total`.
    Counter,
    /// A distribution of times.
    Histogram,
}

impl Kind {
    fn as_str(self) -> &'static str {
        match self {
            Self::Gauge => "gauge",
            Self::Counter => "counter",
            Self::Histogram => "histogram",
        }
    }
}

/// One metric name with its samples.
pub(super) struct Family<'a> {
    text: &'a mut String,
    name: &'static str,
}

impl<'a> Family<'a> {
    pub(super) fn begin(text: &'a mut String, name: &'static str, kind: Kind, what: &str) -> Self {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(text, "# HELP {name} {what}\n# TYPE {name} {}", kind.as_str());
        Self { text, name }
    }

    /// One sample. No label value needs escaping: names of maps hold neither quotes nor backslashes.
    pub(super) fn sample(&mut self, labels: &[(&str, &dyn Display)], value: impl Display) {
        self.part("", labels, value);
    }

    /// The classes of a histogram with these labels, their sum and their number.
    pub(super) fn histogram(&mut self, labels: &[(&str, &dyn Display)], durations: &Durations) {
        let bounds = durations.at_most().map(|(bound_s, count)| (bound_s.to_string(), count));
        for (bound, count) in bounds.chain([("+Inf".to_owned(), durations.count())]) {
            let class: Vec<(&str, &dyn Display)> =
                labels.iter().copied().chain([("le", &bound as &dyn Display)]).collect();
            self.part("_bucket", &class, count);
        }
        self.part("_sum", labels, durations.sum().as_secs_f64());
        self.part("_count", labels, durations.count());
    }

    fn part(&mut self, suffix: &str, labels: &[(&str, &dyn Display)], value: impl Display) {
        let _ = write!(self.text, "{}{suffix}", self.name);
        for (i, (label, value)) in labels.iter().enumerate() {
            let _ = write!(self.text, "{}{label}=\"{value}\"", if i == 0 { '{' } else { ',' });
        }
        let end = if labels.is_empty() { "" } else { "}" };
        let _ = writeln!(self.text, "{end} {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_family_is_help_type_and_samples() {
        let mut text = String::new();
        Family::begin(&mut text, "m", Kind::Gauge, "What it is").sample(&[("map", &"a"), ("level", &2)], 0.5);
        assert_eq!(text, "# HELP m What it is\n# TYPE m gauge\nm{map=\"a\",level=\"2\"} 0.5\n");
    }

    #[test]
    fn a_histogram_is_cumulative_and_ends_with_all() {
        let mut durations = Durations::default();
        for seconds in [0.002, 0.002, 20.0, 100.0] {
            durations.record(Duration::from_secs_f64(seconds));
        }
        let mut text = String::new();
        Family::begin(&mut text, "m", Kind::Histogram, "What").histogram(&[("map", &"a")], &durations);
        for line in [
            "# TYPE m histogram\n",
            "m_bucket{map=\"a\",le=\"0.001\"} 0\n",
            "m_bucket{map=\"a\",le=\"0.0025\"} 2\n",
            "m_bucket{map=\"a\",le=\"60\"} 3\n",
            "m_bucket{map=\"a\",le=\"+Inf\"} 4\n",
            "m_sum{map=\"a\"} 120.004\n",
            "m_count{map=\"a\"} 4\n",
        ] {
            assert!(text.contains(line), "{line} is not in {text}");
        }
    }
}
