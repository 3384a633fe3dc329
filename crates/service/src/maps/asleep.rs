//! A map that is not in memory: its files have all of it.

use std::sync::Arc;

use parking_lot::Mutex;

use super::robots::Robots;
use crate::request::MapInfo;

/// What is kept of a map that sleeps, or that was not opened yet.
#[derive(Debug, Default)]
pub(super) struct Asleep {
    /// What the list of maps tells of it, from when it fell asleep; none of one that was not opened yet.
    pub(super) info: Option<MapInfo>,
    /// What is known of its robots since the server was started, which no file has.
    pub(super) robots: Mutex<Option<Robots>>,
    /// The folders that claimed to be it at the start, where it was not opened yet.
    pub(super) folders: Option<Vec<String>>,
    /// Held while it is opened, and while it falls asleep, until its files are closed.
    pub(super) opening: Arc<tokio::sync::Mutex<()>>,
}

impl Asleep {
    /// A map that was not opened yet, and these folders that claim to be it.
    pub(super) fn not_opened(folders: Vec<String>) -> Self {
        Self { folders: Some(folders), ..Self::default() }
    }

    /// A map that falls asleep, as it is described.
    pub(super) fn of(info: MapInfo) -> Self {
        Self { info: Some(MapInfo { is_asleep: true, ..info }), ..Self::default() }
    }
}
