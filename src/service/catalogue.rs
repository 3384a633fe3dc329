//! The maps by name, in memory and on disk.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use parking_lot::RwLock;
use uuid::Uuid;

use super::hosted_map::HostedMap;
use super::{ErrorCode, ServiceError};
use crate::bloom::FilterSettings;
use crate::map::{MapName, MapSettings, MultiResolutionMap};
use crate::store::{DataDir, Snapshot, StoreError};

/// Names to maps. Files follow the same order of changes as the names: whoever makes, deletes or saves holds
/// `writing`.
#[derive(Debug)]
pub(super) struct Catalogue {
    maps: RwLock<BTreeMap<MapName, Arc<HostedMap>>>,
    data_dir: Option<Arc<DataDir>>,
    writing: tokio::sync::Mutex<()>,
}

impl Catalogue {
    /// Reads the maps of `data_dir`; without one, nothing outlives the process.
    pub(super) fn open(data_dir: Option<PathBuf>) -> Result<Self, ServiceError> {
        let data_dir = data_dir.map(|path| DataDir::open(&path)).transpose().map_err(not_stored)?;
        let mut maps = BTreeMap::new();
        if let Some(data_dir) = &data_dir {
            for name in data_dir.names().map_err(not_stored)? {
                let map = load(data_dir, &name)?;
                maps.insert(name, Arc::new(map));
            }
        }
        Ok(Self { maps: RwLock::new(maps), data_dir: data_dir.map(Arc::new), writing: Default::default() })
    }

    pub(super) fn get(&self, name: &MapName) -> Result<Arc<HostedMap>, ServiceError> {
        self.maps.read().get(name).cloned().ok_or_else(|| {
            let message = format!("map {name} does not exist: make it first, or list the maps there are");
            ServiceError::new(ErrorCode::NotFound, "map_not_found", message)
        })
    }

    pub(super) fn all(&self) -> Vec<Arc<HostedMap>> {
        self.maps.read().values().cloned().collect()
    }

    /// The map of that name; true when it was not there.
    pub(super) async fn create(
        &self,
        name: MapName,
        settings: MapSettings,
        maps_max: usize,
    ) -> Result<(Arc<HostedMap>, bool), ServiceError> {
        let _writing = self.writing.lock().await;
        if let Ok(map) = self.get(&name) {
            return same_settings(map, settings).map(|map| (map, false));
        }
        let count = self.maps.read().len();
        if count >= maps_max {
            let message = format!("there are {count} maps, maps_max is {maps_max}: delete one first");
            return Err(ServiceError::new(ErrorCode::ResourceExhausted, "too_many_maps", message));
        }
        let map = Arc::new(HostedMap::new(name.clone(), Uuid::new_v4(), MultiResolutionMap::new(settings)?));
        let snapshot = Snapshot::of(&map.map, map.uuid);
        self.on_disk({
            let name = name.clone();
            move |data_dir| data_dir.write(&name, &snapshot)
        })
        .await?;
        self.maps.write().insert(name, Arc::clone(&map));
        Ok((map, true))
    }

    pub(super) async fn delete(&self, name: &MapName) -> Result<(), ServiceError> {
        let _writing = self.writing.lock().await;
        self.get(name)?;
        self.on_disk({
            let name = name.clone();
            move |data_dir| data_dir.remove(&name)
        })
        .await?;
        self.maps.write().remove(name);
        Ok(())
    }

    /// Writes the maps that changed; the number of them. One that cannot be written keeps none of the others
    /// from it.
    pub(super) async fn save(&self) -> Result<usize, ServiceError> {
        let _writing = self.writing.lock().await;
        let (mut saved, mut failed) = (0, None);
        for map in self.all() {
            match self.on_disk(move |data_dir| save(data_dir, &map)).await {
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

fn save(data_dir: &DataDir, map: &HostedMap) -> Result<bool, StoreError> {
    let Some(snapshot) = map.unsaved() else {
        return Ok(false);
    };
    data_dir.write(&map.name, &snapshot)?;
    map.saved(snapshot.revision);
    tracing::info!(map = %map.name, revision = snapshot.revision, "saved");
    Ok(true)
}

fn load(data_dir: &DataDir, name: &MapName) -> Result<HostedMap, ServiceError> {
    let snapshot = data_dir.read(name).map_err(not_stored)?;
    let (uuid, revision) = (snapshot.uuid, snapshot.revision);
    let map = snapshot.restore()?;
    tracing::info!(map = %name, revision, voxels = map.voxels(0), "loaded");
    Ok(HostedMap::new(name.clone(), uuid, map))
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
