//! The maps by name, in memory and on disk.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use parking_lot::RwLock;
use uuid::Uuid;

use super::hosted_map::HostedMap;
use super::reach::Reachable;
use super::trajectory::thin;
use super::{ErrorCode, MapReach, ServiceError};
use crate::bloom::FilterSettings;
use crate::map::{MapName, MapSettings, MultiResolutionMap};
use crate::store::{Cut, DataDir, OpeningProgress, Snapshot, StoreError, StoreSettings};

/// Names to maps. Folders follow the same order of changes as the names: whoever makes or deletes holds `writing`.
#[derive(Debug)]
pub(super) struct Catalogue {
    maps: RwLock<BTreeMap<MapName, Arc<HostedMap>>>,
    data_dir: Option<Arc<DataDir>>,
    settings: StoreSettings,
    writing: tokio::sync::Mutex<()>,
}

impl Catalogue {
    /// Opens the maps of `data_dir`; without one, nothing outlives the process.
    pub(super) fn open(
        data_dir: Option<&Path>,
        settings: &StoreSettings,
        progress: &OpeningProgress,
    ) -> Result<Self, ServiceError> {
        let open = |path: &Path| DataDir::open(path, settings.clone());
        let data_dir = data_dir.map(open).transpose().map_err(not_stored)?;
        let mut maps = BTreeMap::new();
        if let Some(data_dir) = &data_dir {
            let names = data_dir.take_stock().map_err(not_stored)?;
            data_dir.expect(&names, progress).map_err(not_stored)?;
            for name in names {
                let map = load(data_dir, &name, settings, progress)?;
                maps.insert(name, Arc::new(map));
            }
        }
        let (maps, data_dir) = (RwLock::new(maps), data_dir.map(Arc::new));
        Ok(Self { maps, data_dir, settings: settings.clone(), writing: Default::default() })
    }

    pub(super) fn get(&self, name: &Reachable) -> Result<Arc<HostedMap>, ServiceError> {
        let name = name.name();
        self.maps.read().get(name).cloned().ok_or_else(|| {
            let message = format!("map {name} does not exist: make it first, or list the maps there are");
            ServiceError::new(ErrorCode::NotFound, "map_not_found", message)
        })
    }

    /// The maps that a caller may name.
    pub(super) fn within(&self, reach: &MapReach) -> Vec<Arc<HostedMap>> {
        self.maps.read().values().filter(|map| reach.covers(&map.name)).cloned().collect()
    }

    fn all(&self) -> Vec<Arc<HostedMap>> {
        self.maps.read().values().cloned().collect()
    }

    /// The map of that name; true when it was not there.
    pub(super) async fn create(
        &self,
        name: Reachable,
        settings: MapSettings,
        maps_max: usize,
    ) -> Result<(Arc<HostedMap>, bool), ServiceError> {
        let _writing = self.writing.lock().await;
        if let Ok(map) = self.get(&name) {
            return same_settings(map, settings).map(|map| (map, false));
        }
        self.check_room(maps_max)?;
        let empty = Snapshot::of(&MultiResolutionMap::new(settings)?, Uuid::new_v4());
        self.add(name.name(), empty).await.map(|map| (map, true))
    }

    /// The map of `snapshot` under a name that is free.
    pub(super) async fn restore(
        &self,
        name: Reachable,
        snapshot: Snapshot,
        maps_max: usize,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        let _writing = self.writing.lock().await;
        if self.get(&name).is_ok() {
            let message =
                format!("map {} exists: delete it first, or restore under another name", name.name());
            return Err(ServiceError::new(ErrorCode::Conflict, "map_exists", message));
        }
        self.check_room(maps_max)?;
        self.add(name.name(), snapshot).await
    }

    fn check_room(&self, maps_max: usize) -> Result<(), ServiceError> {
        let count = self.maps.read().len();
        if count < maps_max {
            return Ok(());
        }
        let message = format!("there are {count} maps, maps_max is {maps_max}: delete one first");
        Err(ServiceError::new(ErrorCode::ResourceExhausted, "too_many_maps", message))
    }

    /// Takes a map into the catalogue, kept and named; the caller holds `writing`.
    async fn add(&self, name: &MapName, snapshot: Snapshot) -> Result<Arc<HostedMap>, ServiceError> {
        let (snapshot, kept_name) = (Arc::new(snapshot), name.clone());
        let kept = Arc::clone(&snapshot);
        let folder = self.on_disk(move |data_dir| data_dir.create(&kept_name, &kept)).await?;
        let (uuid, map) = (snapshot.uuid, Arc::unwrap_or_clone(snapshot).restore()?);
        let map = Arc::new(HostedMap::new(name.clone(), uuid, map, folder, &self.settings)?);
        self.maps.write().insert(name.clone(), Arc::clone(&map));
        Ok(map)
    }

    pub(super) async fn delete(&self, name: &Reachable) -> Result<(), ServiceError> {
        let _writing = self.writing.lock().await;
        let map = self.get(name)?;
        self.on_disk({
            let (name, uuid) = (map.name.clone(), map.uuid);
            move |data_dir| data_dir.remove(&name, uuid)
        })
        .await?;
        self.maps.write().remove(&map.name);
        // Who still holds the map may read it, but nothing is kept of it any more.
        map.committing.end();
        Ok(())
    }

    /// Writes a snapshot of each map by `save`, which says whether it did; the number of those that it wrote. One that
    /// cannot be written keeps none of the others from it.
    pub(super) async fn save(
        &self,
        save: impl Fn(&HostedMap) -> Result<bool, StoreError> + Clone + Send + 'static,
    ) -> Result<usize, ServiceError> {
        let (mut saved, mut failed) = (0, None);
        for map in self.all() {
            let save = save.clone();
            match self.on_disk(move |_| save(&map)).await {
                Ok(written) => saved += usize::from(written.unwrap_or(false)),
                Err(error) => failed = Some(error),
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
        let done = tokio::task::spawn_blocking(move || job(&data_dir)).await;
        let done = done.map_err(|e| ServiceError::new(ErrorCode::Internal, "job_panicked", e.to_string()))?;
        done.map(Some).map_err(not_stored)
    }
}

fn load(
    data_dir: &DataDir,
    name: &MapName,
    settings: &StoreSettings,
    progress: &OpeningProgress,
) -> Result<HostedMap, ServiceError> {
    let start = Instant::now();
    let opened = data_dir.map(name, progress).map_err(not_stored)?;
    for damaged in &opened.damaged {
        tracing::warn!(map = %name, %damaged, "a snapshot is damaged: set aside, an older one and more journal are used");
    }
    if let Some(Cut { path, offset, bytes, reason }) = &opened.recovered.cut {
        let file = path.display();
        tracing::warn!(map = %name, %file, offset, bytes, reason, "cut off an end that was never acknowledged");
    }
    if let Some(harmless) = &opened.recovered.harmless {
        tracing::warn!(map = %name, harmless, "the journal is damaged where the snapshot holds what was there");
    }
    let (revision, replayed, snapshot) = (opened.map.revision(), opened.recovered.replayed, opened.snapshot);
    let (voxels, elapsed) = (opened.map.voxels(0), start.elapsed());
    tracing::info!(map = %name, revision, snapshot, replayed, voxels, ?elapsed, "opened");
    // The snapshot was written before what went when it was there.
    thin(&opened.map, &opened.folder);
    HostedMap::new(name.clone(), opened.uuid, opened.map, Some(opened.folder), settings)
}

/// Making a map again as it is changes nothing; as another it is a conflict.
fn same_settings(map: Arc<HostedMap>, settings: MapSettings) -> Result<Arc<HostedMap>, ServiceError> {
    let there = map.map.settings();
    if *there == settings {
        return Ok(map);
    }
    let describe = |s: &MapSettings| {
        let FilterSettings { hashes, bits_per_key } = s.filter;
        format!(
            "resolution_m {}, levels {}, filter_hashes {hashes}, filter_bits_per_voxel {bits_per_key}",
            s.resolution_m, s.levels
        )
    };
    let message =
        format!("map {} exists with {}, not with {}", map.name, describe(there), describe(&settings));
    Err(ServiceError::new(ErrorCode::Conflict, "map_exists", message))
}

fn not_stored(error: StoreError) -> ServiceError {
    ServiceError::new(ErrorCode::Internal, "not_stored", error.to_string())
}
