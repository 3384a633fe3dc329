//! A map that is not in memory: its files have all of it.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::robots::Robots;
use crate::request::MapInfo;
use crate::work::{Asker, Share, Shares};

/// What is kept of a map that sleeps, or that was not opened yet.
#[derive(Debug, Default)]
pub(super) struct Asleep {
    /// What the list of maps tells of it, from when it fell asleep; none of one that was not opened yet.
    pub(super) info: Option<MapInfo>,
    /// What is known of its robots since the server was started, which no file has.
    pub(super) robots: Mutex<Option<Arc<Robots>>>,
    /// The folders that claimed to be it at the start, where it was not opened yet.
    pub(super) folders: Option<Vec<String>>,
    /// Held while it is opened, and while it falls asleep, until its files are closed.
    pub(super) opening: Arc<tokio::sync::Mutex<()>>,
    /// Since when its files are read.
    opening_since: Mutex<Option<Instant>>,
    /// The places of requests that wait for it, among those that wait for any map.
    waiting: OnceLock<Arc<Shares>>,
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

    /// Reads its files, which [`Asleep::is_opened_for`] tells of meanwhile.
    pub(super) fn open<T>(&self, open: impl FnOnce() -> T) -> T {
        *self.opening_since.lock() = Some(Instant::now());
        // Where it panics, the next request tries again.
        let _opening = Opening(self);
        open()
    }

    /// True of a map whose files are being read for so long and more.
    pub(super) fn is_opened_for(&self, time: Duration) -> bool {
        self.opening_since.lock().is_some_and(|since| since.elapsed() >= time)
    }

    /// A place among those who wait for this map, which are at most half of the `places_of_all` maps: a caller of a map
    /// whose disk hangs has places left for its other maps. None where there is none left.
    pub(super) fn wait(&self, asker: &Asker, places_of_all: usize) -> Option<Share> {
        let places = || Arc::new(Shares::new((places_of_all / 2).max(1)));
        self.waiting.get_or_init(places).take(asker)
    }
}

/// Until it is dropped, a map's files are being read.
struct Opening<'a>(&'a Asleep);

impl Drop for Opening<'_> {
    fn drop(&mut self) {
        *self.0.opening_since.lock() = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_whose_opening_panicked_is_not_being_opened() {
        let asleep = Asleep::default();
        let during = asleep.open(|| asleep.is_opened_for(Duration::ZERO));
        assert!(during && !asleep.is_opened_for(Duration::ZERO));
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            asleep.open(|| panic!("a file that no test has"));
        }));
        assert!(panicked.is_err() && !asleep.is_opened_for(Duration::ZERO));
    }
}
