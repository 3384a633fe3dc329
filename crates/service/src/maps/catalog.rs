//! The maps by name, in memory and on disk.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;
use uuid::Uuid;

use super::built_map::BuiltMap;
use super::hosted_map::HostedMap;
use super::named::{Named, Place};
use super::node_mark::check_node;
use super::opening::{find_all, maps_at_once, not_stored, waiting_within};
use super::same_settings::same_settings;
use crate::caller::{AllowedMaps, Reachable};
use crate::commit::{CommitThreads, Lead, Stop};
use crate::error::{ErrorCode, Reason, ServiceError};
use crate::request::{MapVersion, UnavailableMap};
use crate::settings::ServiceSettings;
use crate::work::{Asker, Shares};
use mrol_map::map::{MapName, MapSettings, MultiResolutionMap};
use mrol_map::sync::{Rank, RwLock};
use mrol_store::{DataDir, MapFolder, OpeningProgress, Snapshot, StoreError, StoreSettings};

/// How long making, replacing, renaming or deleting a map waits for the one before: as long as a disk may reasonably
/// take.
const TURN_MAX: Duration = Duration::from_secs(10);

/// Names to maps. Folders follow the same order of changes as the names: whoever makes or deletes holds `writing`.
#[derive(Debug)]
pub(crate) struct Catalog {
    pub(super) maps: RwLock<Named>,
    pub(super) data_dir: Option<Arc<DataDir>>,
    pub(super) settings: StoreSettings,
    pub(super) commit_threads: Arc<CommitThreads>,
    /// How many maps requests open at once.
    pub(super) openings: Arc<Semaphore>,
    /// Requests that wait for maps that are opened.
    pub(super) waiting: Arc<Shares>,
    /// How often a request opened a map that slept.
    pub(super) wakes: AtomicU64,
    /// How far the maps that were there at the start are opened.
    pub(super) progress: OpeningProgress,
    /// True once every map of the data folder was opened, or could not be.
    pub(super) are_open: watch::Sender<bool>,
    /// True of a node of a cluster: no map takes changes before it has joined its log.
    is_clustered: bool,
    writing: tokio::sync::Mutex<()>,
}

impl Catalog {
    /// Finds the maps of the data folder, none of which is open yet; without a folder, nothing outlives the process.
    pub(crate) fn find_maps(
        settings: &ServiceSettings,
        progress: &OpeningProgress,
    ) -> Result<Self, ServiceError> {
        let ServiceSettings { data_dir, store, limits, .. } = settings;
        let open = |path: &Path| DataDir::open(path, store.clone());
        let data_dir = data_dir.as_deref().map(open).transpose().map_err(not_stored)?;
        if let Some(data_dir) = &data_dir {
            check_node(data_dir, settings)?;
        }
        let maps = data_dir.as_ref().map(|data_dir| find_all(data_dir, progress)).transpose()?;
        let maps = maps.unwrap_or_default();
        Ok(Self {
            are_open: watch::Sender::new(maps.asleep.is_empty()),
            maps: RwLock::new(Rank::Brief, maps),
            data_dir: data_dir.map(Arc::new),
            settings: store.clone(),
            commit_threads: CommitThreads::start()?,
            openings: Arc::new(Semaphore::new(maps_at_once())),
            waiting: waiting_within(limits.requests_max),
            wakes: AtomicU64::new(0),
            progress: progress.clone(),
            is_clustered: settings.cluster.is_some(),
            writing: Default::default(),
        })
    }

    /// The map of that name as it is served; whoever asks uses it from then on.
    pub(super) fn look_up(&self, name: &Reachable) -> Result<Place, ServiceError> {
        let name = name.name();
        let maps = self.maps.read();
        let missing = || match maps.unavailable.get(name) {
            Some(reason) => unavailable(name, reason),
            None => {
                let message = format!("map {name} does not exist: make it first, or list the maps there are");
                ServiceError::new(Reason::MapNotFound, message)
            }
        };
        let place = maps.find(name).ok_or_else(missing)?;
        if let Place::Awake(map) = &place {
            map.note_use();
        }
        Ok(place)
    }

    /// True where there is a map of that name that is served.
    pub(crate) fn has(&self, name: &Reachable) -> bool {
        self.maps.read().find(name.name()).is_some()
    }

    /// The map of that name; none where the name is free.
    async fn find(
        self: &Arc<Self>,
        name: &Reachable,
        asker: &Asker,
    ) -> Result<Option<Arc<HostedMap>>, ServiceError> {
        match self.get(name, asker).await {
            Ok(map) => Ok(Some(map)),
            Err(error) if error.code() == ErrorCode::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The maps in memory that a caller may name.
    pub(crate) fn within(&self, allowed_maps: &AllowedMaps) -> Vec<Arc<HostedMap>> {
        self.maps.read().open.values().filter(|map| allowed_maps.covers(&map.name)).cloned().collect()
    }

    /// Those that could not be opened.
    pub(crate) fn unavailable_within(&self, allowed_maps: &AllowedMaps) -> Vec<UnavailableMap> {
        let maps = self.maps.read();
        let reachable = maps.unavailable.iter().filter(|(name, _)| allowed_maps.covers(name));
        reachable
            .map(|(name, reason)| UnavailableMap { name: name.clone(), reason: reason.clone() })
            .collect()
    }

    /// From now on a server by itself does not open the data folder: a cluster adopts maps of it.
    pub(crate) fn note_adopted(&self) -> Result<(), ServiceError> {
        self.data_dir.as_ref().map_or(Ok(()), |data_dir| data_dir.set_adopted().map_err(not_stored))
    }

    /// Sees that no disk that hangs keeps the changes of other maps waiting; to be called every second or so.
    pub(crate) fn relieve_commits(&self) {
        self.commit_threads.relieve();
    }

    /// The names of the maps that are served, and that a caller may name.
    pub(crate) fn names_within(&self, allowed_maps: &AllowedMaps) -> Vec<MapName> {
        let maps = self.maps.read();
        let mut names: Vec<MapName> = maps.open.keys().chain(maps.asleep.keys()).cloned().collect();
        drop(maps);
        names.retain(|name| allowed_maps.covers(name));
        names.sort_unstable();
        names
    }

    /// The maps in memory.
    pub(crate) fn all(&self) -> Vec<Arc<HostedMap>> {
        self.maps.read().open.values().cloned().collect()
    }

    /// The map of that name; true when it was not there.
    pub(crate) async fn create(
        self: &Arc<Self>,
        name: Reachable,
        settings: MapSettings,
        maps_max: usize,
        asker: &Asker,
    ) -> Result<(Arc<HostedMap>, bool), ServiceError> {
        // One that is there already waits for nobody's disk.
        let found = self.find(&name, asker).await?;
        if let Some(map) = found {
            return same_settings(map, settings).map(|map| (map, false));
        }
        let _writing = self.turn_to_write().await?;
        let found = self.find(&name, asker).await?;
        if let Some(map) = found {
            return same_settings(map, settings).map(|map| (map, false));
        }
        self.check_room(maps_max)?;
        let empty = move || Ok(MultiResolutionMap::new(settings)?);
        self.add(name.name(), Uuid::new_v4(), empty).await.map(|map| (map, true))
    }

    /// A map that was built of a map file under a name that is free; with `replace` under any, where the map that was
    /// there is kept under another name. Beside it the version of the map that had the name.
    pub(crate) async fn restore(
        self: &Arc<Self>,
        name: Reachable,
        built: BuiltMap,
        maps_max: usize,
        replace: bool,
        asker: &Asker,
    ) -> Result<(Option<MapVersion>, Arc<HostedMap>), ServiceError> {
        // Whoever has the turn waits for no map that is opened.
        if replace {
            self.find(&name, asker).await?;
        }
        let _writing = self.turn_to_write().await?;
        self.check_free(&name, maps_max, replace)?;
        let old = self.find(&name, asker).await?;
        // `saving` is held until its snapshot is written.
        let BuiltMap { uuid, map, saving: _saving } = built;
        let build = move || Ok(map);
        let map = match &old {
            None => self.add(name.name(), uuid, build).await?,
            Some(old) => self.replace(Arc::clone(old), uuid, build).await?,
        };
        // Only now does it change no more.
        Ok((old.map(|old| old.version_now()), map))
    }

    /// Refuses a map file for which there is no place, before any work is done for it.
    pub(crate) fn check_free(
        &self,
        name: &Reachable,
        maps_max: usize,
        replace: bool,
    ) -> Result<(), ServiceError> {
        let is_there = self.is_there(name)?;
        if is_there && !replace {
            let name = name.name();
            let message =
                format!("map {name} exists: delete it first, restore under another name, or replace it");
            return Err(ServiceError::new(Reason::MapExists, message));
        }
        self.check_room(maps_max)
    }

    /// True where there is a map of that name.
    fn is_there(&self, name: &Reachable) -> Result<bool, ServiceError> {
        match self.look_up(name) {
            Ok(_) => Ok(true),
            Err(error) if error.code() == ErrorCode::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Waits for the turn to make, replace, rename or delete a map, not for ever: a disk that hangs may hold up its
    /// holder.
    pub(super) async fn turn_to_write(&self) -> Result<tokio::sync::MutexGuard<'_, ()>, ServiceError> {
        let turn = tokio::time::timeout(TURN_MAX, self.writing.lock()).await;
        turn.map_err(|_| {
            let message = format!(
                "another map has been made, replaced, renamed or deleted for {TURN_MAX:?} and more: its disk hangs, or is slow; \
                 try again"
            );
            ServiceError::new(Reason::CatalogBusy, message).retry_after(TURN_MAX)
        })
    }

    fn check_room(&self, maps_max: usize) -> Result<(), ServiceError> {
        let count = self.maps.read().len();
        if count < maps_max {
            return Ok(());
        }
        let message = format!("there are {count} maps, maps_max is {maps_max}: delete one first");
        Err(ServiceError::new(Reason::TooManyMaps, message))
    }

    /// Takes a map into the catalog, kept and named; the caller holds `writing`. It is built before it is kept: one
    /// that the server cannot build is not found again at its next start.
    async fn add(
        &self,
        name: &MapName,
        uuid: Uuid,
        build: impl FnOnce() -> Result<MultiResolutionMap, ServiceError> + Send + 'static,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        let (data_dir, of, settings) = (self.data_dir.clone(), name.clone(), self.settings.clone());
        let threads = Arc::clone(&self.commit_threads);
        let map = blocking(move || {
            let map = build()?;
            let create = |data_dir: Arc<DataDir>| data_dir.create(&of, &Snapshot::of(&map, uuid));
            let folder = data_dir.map(create).transpose().map_err(not_stored)?;
            Ok(Arc::new(HostedMap::new(&threads, of, uuid, map, folder, &settings)))
        })
        .await?;
        self.serve(&mut self.maps.write(), &map);
        Ok(map)
    }

    /// Serves a map from now on, which was opened or made.
    pub(super) fn serve(&self, maps: &mut Named, map: &Arc<HostedMap>) {
        if self.is_clustered && map.lead() == Lead::Alone {
            map.commit_queue.wait_for_log();
        }
        maps.open.insert(map.name.clone(), Arc::clone(map));
    }

    /// Takes a map out, for the reason `why` that its callers are told; its last version.
    pub(crate) async fn delete(
        self: &Arc<Self>,
        name: &Reachable,
        why: Stop,
        asker: &Asker,
    ) -> Result<MapVersion, ServiceError> {
        // Whoever has the turn waits for no map that is opened.
        self.get(name, asker).await?;
        let _writing = self.turn_to_write().await?;
        let map = self.get(name, asker).await?;
        let folder = map.folder.clone();
        let removed =
            self.on_disk(move |data_dir| folder.map_or(Ok(()), |folder| data_dir.remove(&folder))).await;
        let is_gone = map.folder.as_deref().is_none_or(MapFolder::is_gone);
        if is_gone {
            self.maps.write().open.remove(&map.name);
            // Requests that still hold the map may read it, but nothing is kept of it any more.
            map.commit_queue.end(why);
        }
        let version = map.version_now();
        removed.map(|_| version).map_err(|error| match is_gone {
            true => {
                let message = format!(
                    "map {} is gone, but the disk did not say that this outlives a loss of power ({}): look whether it \
                     is there after the next restart",
                    map.name, error.message
                );
                ServiceError::new(Reason::OutcomeUnknown, message)
            }
            false => error,
        })
    }

    /// Does `save` for each map that `needs` it, `at_once` of them side by side; the number of those for which it says
    /// that it wrote a snapshot. One that cannot be written keeps none of the others from it. Of thousands of maps few
    /// need one, and no thread is asked to look at the others.
    pub(crate) async fn save(
        &self,
        at_once: usize,
        needs: impl Fn(&HostedMap) -> bool,
        save: impl Fn(&HostedMap) -> Result<bool, StoreError> + Clone + Send + 'static,
    ) -> Result<usize, ServiceError> {
        let (mut saved, mut failed, mut saving) = (0, None, JoinSet::new());
        let maps = if self.data_dir.is_some() { self.all() } else { Vec::new() };
        let mut rest = maps.into_iter().filter(|map| needs(map));
        loop {
            for map in rest.by_ref().take(at_once - saving.len()) {
                let save = save.clone();
                saving.spawn_blocking(move || save(&map));
            }
            match saving.join_next().await {
                None => break,
                Some(Ok(Ok(is_written))) => saved += usize::from(is_written),
                Some(Ok(Err(error))) => failed = Some(not_stored(error)),
                Some(Err(panic)) => {
                    failed = Some(ServiceError::new(Reason::JobPanicked, panic.to_string()));
                }
            }
        }
        failed.map_or(Ok(saved), Err)
    }

    /// Does something with the data folder on a thread that may block; nothing without one.
    async fn on_disk<T: Send + 'static>(
        &self,
        job: impl FnOnce(&DataDir) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<Option<T>, ServiceError> {
        let Some(data_dir) = self.data_dir.clone() else {
            return Ok(None);
        };
        blocking(move || job(&data_dir).map(Some).map_err(not_stored)).await
    }
}

fn unavailable(name: &MapName, reason: &str) -> ServiceError {
    let message = format!("map {name} could not be opened: {reason}; then restart the server");
    ServiceError::new(Reason::MapUnavailable, message)
}

/// Does something on a thread that may block.
pub(super) async fn blocking<T: Send + 'static>(
    job: impl FnOnce() -> Result<T, ServiceError> + Send + 'static,
) -> Result<T, ServiceError> {
    let done = tokio::task::spawn_blocking(job).await;
    done.unwrap_or_else(|e| Err(ServiceError::new(Reason::JobPanicked, e.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Marks;
    use crate::resources::ResourceBudget;
    use mrol_map::map::MapContents;
    use mrol_map::voxel::VoxelSet;

    const MAPS_MAX: usize = 8;

    fn named(name: &str) -> Reachable {
        AllowedMaps::Every.check(&MapName::new(name).unwrap()).unwrap()
    }

    fn built(settings: MapSettings) -> BuiltMap {
        let contents = MapContents::at(0, VoxelSet::default());
        let map = MultiResolutionMap::restore(settings, contents).unwrap();
        let saving = ResourceBudget::new(None, Marks::default()).reserve(0).unwrap();
        BuiltMap { uuid: Uuid::nil(), map, saving }
    }

    /// What is told within ten times as long as anybody is to wait for its turn to make, replace or delete a map.
    async fn told<T>(waiting: impl Future<Output = Result<T, ServiceError>>) -> Reason {
        let ended = tokio::time::timeout(10 * TURN_MAX, waiting).await.expect("it does not wait for ever");
        ended.map(drop).map_err(|error| error.reason).expect_err("it has no turn")
    }

    #[tokio::test(start_paused = true)]
    async fn who_waits_for_a_turn_that_does_not_come_is_told_so() {
        let progress = OpeningProgress::default();
        let catalog = Catalog::find_maps(&ServiceSettings::default(), &progress).unwrap();
        let catalog = Arc::new(catalog);
        let (settings, one) = (MapSettings::new(0.1, 4), Asker::default());
        catalog.create(named("there"), settings, MAPS_MAX, &one).await.unwrap();
        let turn = catalog.writing.lock().await;
        let busy = Reason::CatalogBusy;
        assert_eq!(told(catalog.create(named("new"), settings, MAPS_MAX, &one)).await, busy);
        assert_eq!(told(catalog.restore(named("new"), built(settings), MAPS_MAX, false, &one)).await, busy);
        assert_eq!(told(catalog.rename(&named("there"), &named("new"), &one)).await, busy);
        assert_eq!(told(catalog.delete(&named("there"), Stop::Deleted, &one)).await, busy);
        // What is there already waits for nobody.
        assert!(!catalog.create(named("there"), settings, MAPS_MAX, &one).await.unwrap().1);
        drop(turn);
        assert!(catalog.create(named("new"), settings, MAPS_MAX, &one).await.unwrap().1);
    }
}
