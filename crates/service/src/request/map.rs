//! Descriptions of maps, and map files.

use std::time::Duration;

use bytes::Bytes;

use super::version::MapVersion;
use crate::error::MapHolder;
use mrol_map::map::{LevelInfo, MapName, MapSettings, RobotName};
use mrol_map::mapping::Sighting;
use mrol_map::util::Durations;
use mrol_store::JournalUse;

/// A map as a map file.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// What a `.mrol` file holds.
    pub bytes: Bytes,
    /// At this state.
    pub version: MapVersion,
}

/// A description of a map.
#[derive(Debug, Clone)]
pub struct MapInfo {
    /// The map's name.
    pub name: MapName,
    /// The map's uuid and revision.
    pub version: MapVersion,
    /// What it was made with.
    pub settings: MapSettings,
    /// Finest first.
    pub levels: Vec<LevelInfo>,
    /// Scans that were accepted and not undone.
    pub scans: usize,
    /// Those of them whose poses are kept.
    pub poses: usize,
    /// The robots that sent the scans, by name.
    pub robots: Vec<RobotName>,
    /// The last scan of each robot since the server was started, by name, whether it was accepted or not; of a list of
    /// maps, none.
    pub sightings: Vec<Sighting>,
    /// Bytes of memory of the exact sets of all levels; this and the bytes below are what a map that sleeps had in
    /// memory.
    pub set_bytes: usize,
    /// Bytes of memory of the points' moments, which alignments are refined with.
    pub moment_bytes: usize,
    /// How long groups of changes took to become durable and visible since the server was started; not sent over the
    /// wire.
    pub commits: Durations,
    /// Bytes of memory of the trajectory, with what is known of scans whose poses are not kept.
    pub trajectory_bytes: usize,
    /// Number of the viewpoints that scans left: where they saw through.
    pub viewpoints: usize,
    /// Bytes of memory of the viewpoints.
    pub viewpoint_bytes: usize,
    /// How it is kept; not at all without a data folder.
    pub storage: Option<MapStorage>,
    /// True of a map that is not in memory: what is told of it is from when it left, and the next request opens it.
    pub is_asleep: bool,
}

impl MapInfo {
    /// True of a map without a voxel.
    pub fn is_empty(&self) -> bool {
        self.levels.first().is_none_or(|finest| finest.voxels == 0)
    }
}

/// How many maps are in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MapsAwake {
    /// Maps in memory.
    pub awake: usize,
    /// Maps that are not in memory: the next request for one opens it.
    pub asleep: usize,
    /// How often a request opened a map that slept, since the server was started.
    pub wakes: u64,
}

/// How a map is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapStorage {
    /// The last revision that is known to be synced.
    pub durable_revision: u64,
    /// The revision of the newest snapshot.
    pub snapshot_revision: u64,
    /// Scans of this revision and later can be undone.
    pub undo_from_revision: u64,
    /// What the journal has done since the server was started; not sent over the wire, as all below but `failure`.
    pub journal: JournalUse,
    /// Time since the newest snapshot was written, or since the server was started where that was later.
    pub snapshot_age: Duration,
    /// Snapshots that could not be written since the server was started.
    pub snapshot_failures: u64,
    /// Bytes on disk.
    pub disk_bytes: u64,
    /// Why the map takes no changes, where it does not.
    pub failure: Option<String>,
}

/// The maps that a caller may name, by name.
#[derive(Debug, Clone, Default)]
pub struct MapList {
    /// The maps that are served.
    pub maps: Vec<MapInfo>,
    /// The maps that could not be opened.
    pub unavailable: Vec<UnavailableMap>,
    /// The maps that other nodes of the cluster hold, and this one does not.
    pub elsewhere: Vec<MapElsewhere>,
}

/// A map that other nodes of the cluster hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapElsewhere {
    /// The map's name.
    pub name: MapName,
    /// Those of its holders that are live: the first is the best. None where none of them is.
    pub holders: Vec<MapHolder>,
}

/// A map that could not be opened. Nothing can be done with it but to put its files right, and to start again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnavailableMap {
    /// The map's name, which is taken.
    pub name: MapName,
    /// Why, and the command that helps.
    pub reason: String,
}
