//! Maps that nobody uses leave memory as a whole, and are opened by the next request.
//!
//! ```text
//! open --nobody has used it for so long--> saved, described --still nobody--> asleep: its files are closed
//! asleep --a request--> opened, once for all who ask meanwhile --> open
//! ```
//!
//! Whoever uses a map holds it, and gets it under the lock of the names. So a map that the names alone hold, under that
//! lock, is used by nobody, and nobody can begin to. Its files are closed before they are opened again: closing and
//! opening both hold [`Asleep::opening`].

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::asleep::Asleep;
use super::catalog::Catalog;
use super::hosted_map::{Closed, HostedMap, RATE_SAMPLES};
use super::named::Place;
use super::opening::open_one;
use super::saving::Saving;
use crate::caller::{AllowedMaps, Reachable};
use crate::error::{Reason, ServiceError};
use crate::request::{MapInfo, MapsAwake};
use crate::resources::ResourceBudget;
use crate::work::Asker;
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;
use mrol_store::{OpeningProgress, StoreError};
use tokio::time::timeout;

/// How long a request waits for a map that is opened.
pub(super) const OPENING_MAX: Duration = Duration::from_secs(10);
/// When a request that found no place among those that wait may be sent again.
const RETRY: Duration = Duration::from_secs(1);
/// How long a map that is opened keeps others from being opened, where all places are taken.
const PLACE_MAX: Duration = Duration::from_secs(5);

impl Catalog {
    /// The map of that name, which is opened where it sleeps: once for all requests meanwhile, even where the first one
    /// is given up.
    ///
    /// A disk that hangs under a map keeps nobody waiting for ever, and no other map from being opened: after
    /// [`PLACE_MAX`] its place goes to another. Nor do those who wait for it keep requests for other maps out: they are
    /// a share of all requests, half of it for one map; of both, one asker has as many as places are left. Once its
    /// opening has taken [`PLACE_MAX`], further requests are refused at once.
    pub(crate) async fn get(
        self: &Arc<Self>,
        name: &Reachable,
        asker: &Asker,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        let mut waiting = None;
        loop {
            let place = self.look_up(name)?;
            let asleep = match place {
                Place::Awake(map) => return Ok(map),
                Place::Asleep(asleep) => asleep,
            };
            if asleep.is_opened_for(PLACE_MAX) {
                return Err(still_opening(name.name(), PLACE_MAX));
            }
            if waiting.is_none() {
                let of_map = asleep.wait(asker, self.waiting.most());
                let places = of_map.zip(self.waiting.take(asker));
                waiting = Some(places.ok_or_else(|| too_many_wait(name.name()))?);
            }
            // A request that waits holds no thread.
            let opened = timeout(OPENING_MAX, Arc::clone(self).open_for_request(name.name().clone(), asleep));
            opened.await.unwrap_or_else(|_| Err(still_opening(name.name(), OPENING_MAX)))?;
        }
    }

    /// Opens a map that sleeps, once nobody else does and there is a place.
    async fn open_for_request(
        self: Arc<Self>,
        name: MapName,
        asleep: Arc<Asleep>,
    ) -> Result<(), ServiceError> {
        let opening = Arc::clone(&asleep.opening).lock_owned().await;
        let turn = Arc::clone(&self.openings).acquire_owned().await;
        // One that was not opened yet is one of those whose opening is told, and ends with the server.
        let progress = if asleep.info.is_none() { self.progress.clone() } else { OpeningProgress::default() };
        let work = tokio::task::spawn_blocking(move || {
            let woken = self.open_asleep(&name, &asleep, &progress);
            drop(opening);
            woken.map(drop).map_err(|error| {
                let message = format!("map {name} cannot be opened now: {error}");
                ServiceError::new(Reason::MapUnavailable, message)
            })
        });
        // Whoever asked may go meanwhile; the place is taken for as long as an opening may take.
        let opened = tokio::spawn(async move {
            let mut work = work;
            let in_time = timeout(PLACE_MAX, &mut work).await;
            drop(turn);
            match in_time {
                Ok(opened) => opened,
                Err(_) => work.await,
            }
        });
        let opened = opened.await.and_then(std::convert::identity);
        opened.unwrap_or_else(|panic| Err(ServiceError::new(Reason::JobPanicked, panic.to_string())))
    }

    /// Opens a map that sleeps, unless somebody else did meanwhile, or it is gone. The caller holds its `opening`. One
    /// that was never opened, and cannot be, is unavailable from then on. True where it is open now by this.
    pub(super) fn open_asleep(
        &self,
        name: &MapName,
        asleep: &Arc<Asleep>,
        progress: &OpeningProgress,
    ) -> Result<bool, StoreError> {
        let is_it = |now: &Arc<Asleep>| Arc::ptr_eq(now, asleep);
        let Some(data_dir) =
            self.data_dir.as_ref().filter(|_| self.maps.read().asleep.get(name).is_some_and(is_it))
        else {
            return Ok(false);
        };
        match asleep.open(|| open_one(data_dir, name, asleep.folders.as_deref(), progress)) {
            Ok(opened) => {
                let robots = asleep.robots.lock().take().unwrap_or_default();
                let map =
                    HostedMap::opened(&self.commit_threads, name.clone(), opened, robots, &self.settings);
                let mut maps = self.maps.write();
                maps.asleep.remove(name);
                self.serve(&mut maps, &Arc::new(map));
                drop(maps);
                if asleep.info.is_some() {
                    self.wakes.fetch_add(1, Ordering::Relaxed);
                }
                Ok(true)
            }
            Err(StoreError::Cancelled) => Err(StoreError::Cancelled),
            Err(error) if asleep.info.is_none() => {
                self.maps.write().set_unavailable(name.clone(), &error);
                Ok(true)
            }
            Err(error) => {
                tracing::error!(map = %name, %error, "a map that sleeps cannot be opened: the next request tries again");
                Err(error)
            }
        }
    }

    /// The names of maps that nobody has asked for for so long.
    pub(crate) fn unused_for(&self, unused_for: Duration) -> Vec<MapName> {
        let maps = self.maps.read();
        let unused = maps.open.values().filter(|map| map.is_unused_for(unused_for));
        unused.map(|map| map.name.clone()).collect()
    }

    /// Saves a map that nobody has asked for for so long, and takes it out of memory, where nobody uses it, no keep-out
    /// of it is to end, and it can be saved; true where it did. Waits for the disk.
    pub(crate) fn put_to_sleep(&self, name: &MapName, unused_for: Duration, budget: &ResourceBudget) -> bool {
        let found = self.maps.read().open.get(name).cloned();
        let Some(info) = found.and_then(|map| map.prepare_to_sleep(budget)) else { return false };
        let revision = info.version.revision;
        let asleep = Arc::new(Asleep::of(info));
        let Ok(leaving) = Arc::clone(&asleep.opening).try_lock_owned() else { return false };
        let mut maps = self.maps.write();
        let may_leave = |map: &Arc<HostedMap>| {
            Arc::strong_count(map) == 1 && map.is_unused_for(unused_for) && map.may_close(revision)
        };
        if !maps.open.get(name).is_some_and(may_leave) {
            return false;
        }
        let Some(map) = maps.open.remove(name) else { return false };
        let map = match Arc::try_unwrap(map) {
            Ok(map) => map,
            Err(map) => {
                maps.open.insert(name.clone(), map);
                return false;
            }
        };
        maps.asleep.insert(name.clone(), Arc::clone(&asleep));
        drop(maps);
        let Closed { robots, done } = map.close();
        *asleep.robots.lock() = Some(robots);
        // It is opened again only once its files are closed.
        drop(done.blocking_recv());
        drop(leaving);
        tracing::debug!(map = %name, "asleep");
        true
    }

    /// The maps in memory that the caller may name, and what is told of those that sleep. Each is one of the two.
    pub(crate) fn listed_within(&self, allowed_maps: &AllowedMaps) -> (Vec<Arc<HostedMap>>, Vec<MapInfo>) {
        let maps = self.maps.read();
        let awake = maps.open.values().filter(|map| allowed_maps.covers(&map.name)).cloned().collect();
        let asleep = maps.asleep.iter().filter(|(name, _)| allowed_maps.covers(name));
        (awake, asleep.filter_map(|(_, asleep)| asleep.info.clone()).collect())
    }

    /// How many maps are in memory, and how many are not.
    pub(crate) fn awake(&self) -> MapsAwake {
        let maps = self.maps.read();
        let (awake, asleep) = (maps.open.len(), maps.asleep.len());
        MapsAwake { awake, asleep, wakes: self.wakes.load(Ordering::Relaxed) }
    }
}

/// A map that is opened, for which too many wait already.
fn too_many_wait(name: &MapName) -> ServiceError {
    let message = format!(
        "map {name} is not open yet, and as many requests of this caller wait for maps that are opened, this one or \
         others, as may: try again"
    );
    ServiceError::new(Reason::CatalogBusy, message).retry_after(RETRY)
}

/// A map whose opening takes longer than anybody waits for.
fn still_opening(name: &MapName, waited: Duration) -> ServiceError {
    let message = format!(
        "map {name} is not open after {waited:?}: it is large, its disk hangs, or others are opened first; try again"
    );
    ServiceError::new(Reason::CatalogBusy, message).retry_after(OPENING_MAX)
}

impl HostedMap {
    /// Saves the map, and describes it as it is then; none where it is not to leave memory.
    fn prepare_to_sleep(&self, budget: &ResourceBudget) -> Option<MapInfo> {
        let folder = self.folder.as_ref().filter(|_| self.commit_queue.stopped().is_none())?;
        let ends =
            |keep_outs: &mrol_map::map::KeepOuts| keep_outs.iter().any(|it| it.expires_at_ns.is_some());
        // The server ends them in time, for which it has to look at them.
        if ends(&self.map.keep_outs()) {
            return None;
        }
        let failed =
            |error: &StoreError| tracing::warn!(map = %self.name, %error, "not saved, and so kept in memory");
        self.save(Saving::Changed, budget).inspect_err(failed).ok()?;
        let info = self.describe(RATE_SAMPLES, StopSignal::NEVER).ok()?;
        (folder.used().snapshot == info.version.revision).then_some(info)
    }
}
