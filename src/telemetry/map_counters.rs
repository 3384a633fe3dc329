//! What is counted by map. It is kept here and not by the recorder, which forgets no series: a map that is gone leaves
//! none behind.

use mrol_map::util::Keyword;
use std::collections::BTreeMap;
use std::sync::Arc;

use parking_lot::Mutex;

use mrol_map::align::Verdict;
use mrol_map::map::{Lookup, MapName};
use mrol_map::mapping::Recovered;

/// A counter with the map as its first label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Family {
    DeletionsUndone,
    PointsQueried,
    RobotsRecovered,
    Scans,
    ScansUndone,
    VoxelsRemoved,
    VoxelsRestored,
}

impl Family {
    pub(super) const ALL: [Self; 7] = [
        Self::DeletionsUndone,
        Self::PointsQueried,
        Self::RobotsRecovered,
        Self::Scans,
        Self::ScansUndone,
        Self::VoxelsRemoved,
        Self::VoxelsRestored,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::DeletionsUndone => "mrol_deletions_undone_total",
            Self::PointsQueried => "mrol_points_queried_total",
            Self::RobotsRecovered => "mrol_robots_recovered_total",
            Self::Scans => "mrol_scans_total",
            Self::ScansUndone => "mrol_scans_undone_total",
            Self::VoxelsRemoved => "mrol_voxels_removed_total",
            Self::VoxelsRestored => "mrol_voxels_restored_total",
        }
    }

    pub(super) fn help(self) -> &'static str {
        match self {
            Self::DeletionsUndone => "Deletions taken back by undos, by map",
            Self::PointsQueried => "Points answered, by map and look-up",
            Self::RobotsRecovered => "Scans by which a lost robot was found again, by map and how",
            Self::Scans => "Scans judged for insertion, by map and verdict",
            Self::ScansUndone => "Scans taken out again, by map",
            Self::VoxelsRemoved => "Finest voxels removed by deletions and undos, by map",
            Self::VoxelsRestored => "Finest voxels put back by undos, by map",
        }
    }
}

/// A series of one map: its family, and its label after the map's where it has one.
pub(super) type Series = (Family, Option<(&'static str, &'static str)>);

/// The counters of all maps. A clone is another handle on the same ones.
#[derive(Debug, Clone, Default)]
pub(super) struct MapCounters(Arc<Mutex<BTreeMap<MapName, BTreeMap<Series, u64>>>>);

impl MapCounters {
    pub(super) fn points_queried(&self, map: &MapName, lookup: Lookup, points: usize) {
        self.count(map, (Family::PointsQueried, Some(("lookup", lookup.as_str()))), points);
    }

    pub(super) fn recovered(&self, map: &MapName, how: Recovered) {
        self.count(map, (Family::RobotsRecovered, Some(("how", how.as_str()))), 1);
    }

    pub(super) fn scan(&self, map: &MapName, verdict: Verdict) {
        self.count(map, (Family::Scans, Some(("verdict", verdict.as_str()))), 1);
    }

    pub(super) fn count(&self, map: &MapName, series: Series, by: usize) {
        let mut maps = self.0.lock();
        // A name is copied when a map is counted for the first time.
        if !maps.contains_key(map) {
            maps.insert(map.clone(), BTreeMap::new());
        }
        if let Some(counters) = maps.get_mut(map) {
            *counters.entry(series).or_default() += by as u64;
        }
    }

    /// Drops the counters of maps that are not among `names`.
    pub(super) fn keep(&self, names: &[MapName]) {
        self.0.lock().retain(|map, _| names.contains(map));
    }

    /// The counters of the maps among `names`.
    pub(super) fn of(&self, names: &[MapName]) -> Vec<(MapName, BTreeMap<Series, u64>)> {
        let maps = self.0.lock();
        maps.iter().filter(|(map, _)| names.contains(map)).map(|(m, c)| (m.clone(), c.clone())).collect()
    }
}
