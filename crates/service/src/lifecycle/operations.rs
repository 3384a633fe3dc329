//! The operations on maps as a whole.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;

use super::map_file::from_file;
use crate::caller::AllowedMaps;
use crate::commit::Stop;
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::{HostedMap, RATE_SAMPLES, Saving, maps_at_once};
use crate::observer::{Change, Outcome};
use crate::request::{MapElsewhere, MapFile, MapInfo, MapsAwake, UnavailableMap};
use mrol_map::map::{MapName, MapSettings};
use mrol_map::mapping::Sighting;
use mrol_map::sync::polled_by_runtime;
use mrol_map::util::StopSignal;
use mrol_store::Opened;

/// How long the description of a map waits for another node's sightings of robots.
const SIGHTINGS_WAIT_MAX: Duration = Duration::from_secs(2);

impl MapService {
    /// Makes a map; true when it was not there. The same settings again are fine.
    ///
    /// # Errors
    /// `InvalidArgument` for settings out of range, `Conflict` where it exists with others, `ResourceExhausted`
    /// beyond `maps_max`, or while disk or memory is nearly full.
    pub async fn create_map(
        &self,
        name: MapName,
        settings: MapSettings,
    ) -> Result<(MapInfo, bool), ServiceError> {
        let map = &name.clone();
        let work = async {
            if let Some(cluster) = &self.inner.settings.cluster {
                let (map, created) = self.create_in(cluster, &name, settings).await?;
                return Ok((describe_made(map).await?, created));
            }
            let name = self.allowed_maps.check(&name)?;
            let is_new = !self.inner.catalog.has(&name);
            let settings = settings.checked()?;
            if is_new {
                self.inner.budget.check_to_grow()?;
            }
            let (inner, asker) = (Arc::clone(&self.inner), self.asker.clone());
            let create = async move {
                let _empty =
                    is_new.then(|| inner.budget.reserve(settings.first_filter_bytes())).transpose()?;
                inner.catalog.create(name, settings, inner.settings.limits.maps_max, &asker).await
            };
            let (map, created) = run_to_completion(create).await?;
            Ok((describe_made(map).await?, created))
        };
        self.observed("CreateMap", Some(map), work, |(info, created)| {
            let before = (!created).then_some(info.version);
            Outcome::Changed(Change::of_map(before, Some(info.version)))
        })
        .await
    }

    /// Describes a map, with the last sighting of each robot. Where another node leads, that one has seen the robots:
    /// if it does not answer, none are told.
    ///
    /// # Errors
    /// `NotFound` without such a map.
    pub async fn map_info(&self, name: &MapName) -> Result<MapInfo, ServiceError> {
        let work = async {
            let map = self.map(name).await?;
            let sightings = self.sightings_of(&map).await;
            Ok(MapInfo { sightings, ..self.describe(map).await? })
        };
        self.observed("GetMap", Some(name), work, |_| Outcome::Read).await
    }

    /// Describes all maps that the caller may name, by name, those that sleep as they fell asleep. While maps are being
    /// opened, waits until they are, for ten seconds at most.
    ///
    /// # Errors
    /// `ResourceExhausted` when too many jobs wait, `CatalogBusy` where maps are opened for longer.
    pub async fn list_maps(&self) -> Result<Vec<MapInfo>, ServiceError> {
        let work = async {
            self.inner.catalog.all_open().await?;
            self.describe_all().await
        };
        self.observed("ListMaps", None, work, |_| Outcome::Read).await
    }

    /// As [`MapService::list_maps`], of the maps that are open by now.
    ///
    /// # Errors
    /// As there.
    pub async fn list_open_maps(&self) -> Result<Vec<MapInfo>, ServiceError> {
        self.observed("ListMaps", None, self.describe_all(), |_| Outcome::Read).await
    }

    async fn describe_all(&self) -> Result<Vec<MapInfo>, ServiceError> {
        // Those that sleep are not woken.
        let (maps, mut asleep) = self.inner.catalog.listed_within(&self.allowed_maps);
        let describe = move |stop: StopSignal<'_>| {
            let described = maps.iter().map(|map| {
                stop.give_way();
                map.describe(RATE_SAMPLES, stop)
            });
            described.collect()
        };
        let described: Result<Vec<MapInfo>, _> = self.inner.lanes.reads.run(&self.asker, describe).await?;
        let mut all = described?;
        all.append(&mut asleep);
        all.sort_unstable_by(|a, b| a.name.cmp(&b.name));
        Ok(all)
    }

    /// The names of the maps that the caller may name.
    pub fn map_names(&self) -> Vec<MapName> {
        self.inner.catalog.names_within(&self.allowed_maps)
    }

    /// The maps that take no changes since their journal failed, by name, with the reason.
    pub fn read_only_maps(&self) -> Vec<(MapName, String)> {
        let maps = self.inner.catalog.within(&self.allowed_maps);
        maps.iter().filter_map(|map| Some((map.name.clone(), map.failure()?.to_owned()))).collect()
    }

    /// The maps that could not be opened, by name, with the reason and what helps. Their names are taken.
    pub fn unavailable_maps(&self) -> Vec<UnavailableMap> {
        self.inner.catalog.unavailable_within(&self.allowed_maps)
    }

    /// The maps that other nodes of the cluster hold, by name: those that the caller may name and of which this node
    /// has no copy.
    pub fn maps_elsewhere(&self) -> Vec<MapElsewhere> {
        let Some(cluster) = &self.inner.settings.cluster else { return Vec::new() };
        let is_meant = |map: &MapElsewhere| {
            let reachable = self.allowed_maps.check(&map.name);
            reachable.is_ok_and(|reachable| !self.inner.catalog.has(&reachable))
        };
        cluster.catalog.held_elsewhere().into_iter().filter(is_meant).collect()
    }

    /// Opens the maps of the data folder side by side, and serves each as soon as it is open; where maps sleep, they
    /// fall asleep as soon as they have been looked at. Not for an async thread.
    ///
    /// # Errors
    /// Once the progress with which the service was begun is cancelled.
    pub fn open_maps(&self) -> Result<(), ServiceError> {
        let (inner, sleeps) = (&self.inner, self.inner.settings.sleep_after.is_some());
        inner.catalog.open_all(|name| {
            if sleeps {
                inner.catalog.put_to_sleep(name, Duration::ZERO, &inner.budget);
            }
        })
    }

    /// How far the maps of the data folder are opened; none once that is done.
    pub fn opening(&self) -> Option<Opened> {
        self.inner.catalog.opening()
    }

    /// Saves the maps that nobody has asked for for `sleep_after`, and that nobody uses or watches, and takes them out
    /// of memory; how many. To be called every now and then.
    pub async fn put_unused_to_sleep(&self) -> usize {
        let Some(sleep_after) = self.inner.settings.sleep_after else { return 0 };
        let mut asleep = 0;
        for name in self.inner.catalog.unused_for(sleep_after) {
            let inner = Arc::clone(&self.inner);
            let put = move || inner.catalog.put_to_sleep(&name, sleep_after, &inner.budget);
            asleep += usize::from(tokio::task::spawn_blocking(put).await.unwrap_or(false));
        }
        asleep
    }

    /// How many maps are in memory, and how often one was opened again.
    pub fn maps_awake(&self) -> MapsAwake {
        self.inner.catalog.awake()
    }

    /// Takes a map out, in memory and on disk.
    ///
    /// # Errors
    /// `NotFound` without such a map; `Internal` when its file cannot be removed; `Unavailable` with `outcome_unknown`
    /// when it is gone, and a loss of power may bring it back.
    pub async fn delete_map(&self, name: &MapName) -> Result<(), ServiceError> {
        let work = async {
            if let Some(cluster) = &self.inner.settings.cluster {
                return self.delete_in(cluster, name).await;
            }
            let (inner, asker) = (Arc::clone(&self.inner), self.asker.clone());
            let name = self.allowed_maps.check(name)?;
            run_to_completion(async move { inner.catalog.delete(&name, Stop::Deleted, &asker).await }).await
        };
        let outcome = |version: &_| Outcome::Changed(Change::of_map(Some(*version), None));
        self.observed("DeleteMap", Some(name), work, outcome).await.map(drop)
    }

    /// Gives a map another name. Its uuid, its revision and what undo reaches stay; watches and changes under way under
    /// its former name end with `map_not_found`.
    ///
    /// # Errors
    /// `NotFound` without such a map; `Conflict` where there is a map of the name `to`; `PermissionDenied` where the
    /// caller may not name both; `Internal` when its folder cannot be renamed; `Unavailable` with `outcome_unknown`
    /// when it is renamed, and a loss of power may bring its former name back.
    pub async fn rename_map(&self, name: &MapName, to: &MapName) -> Result<MapInfo, ServiceError> {
        let work = async {
            if self.inner.settings.cluster.is_some() {
                let message = "the nodes of a cluster rename no map: make another, or restore a copy under another name";
                return Err(ServiceError::new(Reason::MapShared, message));
            }
            let (inner, asker) = (Arc::clone(&self.inner), self.asker.clone());
            let (name, to) = (self.allowed_maps.check(name)?, self.allowed_maps.check(to)?);
            let rename = async move { inner.catalog.rename(&name, &to, &asker).await };
            describe_made(run_to_completion(rename).await?).await
        };
        let outcome = |info: &MapInfo| Outcome::Changed(Change::of_renaming(info.name.clone(), info.version));
        self.observed("RenameMap", Some(name), work, outcome).await
    }

    /// A map as a map file, at one revision.
    ///
    /// # Errors
    /// `NotFound` without such a map; `ResourceExhausted` when too many jobs wait, there is no memory for it, or the
    /// file would be larger than `map_file_bytes_max`, so that nobody could restore it.
    pub async fn snapshot_map(&self, name: &MapName) -> Result<MapFile, ServiceError> {
        let work = async {
            let (map, inner) = (self.map(name).await?, Arc::clone(&self.inner));
            self.inner
                .lanes
                .map_files
                .run(&self.asker, move |stop| map.to_file(&inner.budget, &inner.settings.limits, stop))
                .await?
        };
        self.observed("SnapshotMap", Some(name), work, |_| Outcome::Read).await
    }

    /// Makes a map from a map file, under a uuid of its own. With `replace` it takes the place of the map of that name,
    /// if there is one, which is kept as `NAME-replaced-REVISION` until somebody deletes it.
    ///
    /// # Errors
    /// `InvalidArgument` for a file that is none, or damaged; `Conflict` where there is a map of that name, unless
    /// `replace` says that it is to be kept under another; `ResourceExhausted` beyond `map_file_bytes_max`, `maps_max`,
    /// `voxels_per_map_max` or `map_file_scans_max`, where there is no memory for what it holds, or while disk or
    /// memory is nearly full.
    pub async fn restore_map(
        &self,
        name: MapName,
        file: Bytes,
        replace: bool,
    ) -> Result<MapInfo, ServiceError> {
        let map = &name.clone();
        let work = async {
            if let Some(cluster) = &self.inner.settings.cluster {
                let map = self.restore_in(cluster, &name, file, replace).await?;
                return Ok((None, describe_made(map).await?));
            }
            let name = self.allowed_maps.check(&name)?;
            if replace && self.allowed_maps != AllowedMaps::Every {
                let message = "replace keeps the map that was there under another name, which takes a key for all maps: \
                               delete the map first, or ask with such a key";
                return Err(ServiceError::new(Reason::MapNotAllowed, message));
            }
            self.inner.budget.check_to_grow()?;
            self.inner.catalog.check_free(&name, self.limits().maps_max, replace)?;
            let inner = Arc::clone(&self.inner);
            let build =
                move |stop: StopSignal<'_>| from_file(&file, &inner.settings.limits, &inner.budget, stop);
            let built = self.inner.lanes.map_files.run(&self.asker, build).await??;
            let (inner, asker) = (Arc::clone(&self.inner), self.asker.clone());
            let maps_max = self.limits().maps_max;
            let restore = async move { inner.catalog.restore(name, built, maps_max, replace, &asker).await };
            let (before, map) = run_to_completion(restore).await?;
            Ok((before, describe_made(map).await?))
        };
        let outcome =
            |(before, info): &(_, MapInfo)| Outcome::Changed(Change::of_map(*before, Some(info.version)));
        Ok(self.observed("RestoreMap", Some(map), work, outcome).await?.1)
    }

    /// Writes snapshots of the maps that changed since their last one; the number of them. Those for which there is no
    /// room, on disk or in memory, are put off: the journal has all that they would hold.
    ///
    /// # Errors
    /// `Internal` when a file cannot be written; the others are written all the same.
    pub async fn save(&self) -> Result<usize, ServiceError> {
        // Nobody else wants the cores, and the time is short.
        self.save_maps(Saving::Changed, maps_at_once()).await
    }

    /// Writes snapshots of the maps with much journal or an old snapshot; to be called every now and then.
    ///
    /// # Errors
    /// As for [`MapService::save`].
    pub async fn save_due(&self) -> Result<usize, ServiceError> {
        let inner = Arc::clone(&self.inner);
        let is_scarce = inner.budget.is_disk_scarce();
        let make_room = move |map: &HostedMap| map.make_room(&inner.budget).map(|()| false);
        let made_room = self.inner.catalog.save(1, |_| is_scarce, make_room).await;
        // The others are saved all the same: their journals grow just where there is no room.
        let saved = self.save_maps(Saving::Due, 1).await;
        made_room.and(saved)
    }

    async fn save_maps(&self, which: Saving, at_once: usize) -> Result<usize, ServiceError> {
        let inner = Arc::clone(&self.inner);
        let needs = move |map: &HostedMap| map.needs_saving(which);
        self.inner.catalog.save(at_once, needs, move |map| map.save(which, &inner.budget)).await
    }

    async fn sightings_of(&self, map: &HostedMap) -> Vec<Sighting> {
        let Some((leader, call)) = self.leader_elsewhere(map) else { return map.robots.sightings.to_vec() };
        let asked = tokio::time::timeout(SIGHTINGS_WAIT_MAX, leader.sightings(&call)).await;
        asked.ok().and_then(Result::ok).unwrap_or_default()
    }

    async fn describe(&self, map: Arc<HostedMap>) -> Result<MapInfo, ServiceError> {
        self.inner.lanes.reads.run(&self.asker, move |stop| map.describe(RATE_SAMPLES, stop)).await?
    }
}

/// Describes a map that was just made, on no lane: its maker is answered, whatever else the server has to do.
async fn describe_made(map: Arc<HostedMap>) -> Result<MapInfo, ServiceError> {
    let described = tokio::task::spawn_blocking(move || map.describe(RATE_SAMPLES, StopSignal::NEVER));
    described.await.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()))
}

/// Runs what must not stop halfway, whoever goes on waiting for it: memory and disk would disagree.
pub(super) async fn run_to_completion<T: Send + 'static>(
    change: impl Future<Output = Result<T, ServiceError>> + Send + 'static,
) -> Result<T, ServiceError> {
    let done = tokio::spawn(polled_by_runtime(change)).await;
    done.unwrap_or_else(|e| Err(ServiceError::new(Reason::JobPanicked, e.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Limits;
    use crate::map_service::MapService;
    use crate::settings::ServiceSettings;
    use crate::work::Asker;
    use mrol_store::OpeningProgress;

    #[tokio::test(flavor = "multi_thread")]
    async fn who_makes_a_map_is_told_so_whatever_the_server_has_to_do_besides() {
        let settings = ServiceSettings {
            query_threads: 1,
            limits: Limits { jobs_waiting_max: 1, ..Limits::default() },
            ..ServiceSettings::default()
        };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let (hold, held) = std::sync::mpsc::channel::<()>();
        let held = std::sync::Mutex::new(held);
        let inner = Arc::clone(&service.inner);
        let first = tokio::spawn(async move {
            inner.lanes.reads.run(&Asker::default(), move |_| held.lock().unwrap().recv().is_ok()).await
        });
        let inner = Arc::clone(&service.inner);
        let second = tokio::spawn(async move { inner.lanes.reads.run(&Asker::default(), |_| ()).await });
        let waiting = || service.lanes().iter().find(|lane| lane.name == "read").unwrap().waiting;
        while waiting() == 0 {
            tokio::task::yield_now().await;
        }
        let name = |n: u32| MapName::new(&format!("m{n}")).unwrap();
        let settings = MapSettings::new(0.1, 4);
        service.create_map(name(0), settings).await.unwrap();
        assert_eq!(service.map_info(&name(0)).await.unwrap_err().reason, Reason::Overloaded);
        for n in 0..5 {
            let (info, created) = service.create_map(name(n), settings).await.unwrap();
            assert_eq!((info.name, created), (name(n), n > 0), "map {n}");
        }
        drop(hold);
        first.await.unwrap().unwrap();
        second.await.unwrap().unwrap();
    }
}
