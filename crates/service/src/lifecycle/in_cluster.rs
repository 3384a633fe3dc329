//! Maps are made, restored and deleted where all nodes of a cluster share the list of maps.

use std::sync::Arc;

use bytes::Bytes;
use uuid::Uuid;

use super::map_file::from_file;
use crate::cluster::{Cluster, NewMap};
use crate::commit::Lead;
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::{BuiltMap, HostedMap, same_settings};
use crate::replication::Base;
use crate::request::MapVersion;
use mrol_map::map::{MapName, MapSettings, MultiResolutionMap};
use mrol_map::util::StopSignal;
use mrol_store::Snapshot;

impl MapService {
    /// The map of that name; true where this call made it.
    pub(super) async fn create_in(
        &self,
        cluster: &Cluster,
        name: &MapName,
        settings: MapSettings,
    ) -> Result<(Arc<HostedMap>, bool), ServiceError> {
        let reachable = self.allowed_maps.check(name)?;
        let settings = settings.checked()?;
        let mut is_new = false;
        if !self.inner.catalog.has(&reachable) {
            self.inner.budget.check_to_grow()?;
            self.inner.catalog.check_free(&reachable, self.limits().maps_max, false)?;
            // On no lane: its maker is answered, whatever else the server has to do.
            let made = tokio::task::spawn_blocking(move || empty_map(settings)).await;
            let new = made.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()))?;
            is_new = cluster.catalog.enter(name, new).await?;
        }
        Ok((same_settings(self.map(name).await?, settings)?, is_new))
    }

    /// A map from a map file, under a name that is free.
    pub(super) async fn restore_in(
        &self,
        cluster: &Cluster,
        name: &MapName,
        file: Bytes,
        replace: bool,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        let reachable = self.allowed_maps.check(name)?;
        if replace {
            let message =
                "the nodes of a cluster replace no map: delete it first, or restore under another name";
            return Err(ServiceError::new(Reason::MapShared, message));
        }
        self.inner.budget.check_to_grow()?;
        self.inner.catalog.check_free(&reachable, self.limits().maps_max, false)?;
        // This node reads it as the others will, and refuses for all of them what is no map.
        let (inner, read) = (Arc::clone(&self.inner), file.clone());
        let described = move |stop: StopSignal<'_>| {
            let BuiltMap { uuid, map, .. } = from_file(&read, &inner.settings.limits, &inner.budget, stop)?;
            Ok((uuid, base_of(&map)))
        };
        let described: Result<_, ServiceError> =
            self.inner.lanes.map_files.run(&self.asker, described).await?;
        let (uuid, base) = described?;
        if !cluster.catalog.enter(name, NewMap { uuid, base, file }).await? {
            return Err(ServiceError::new(
                Reason::MapExists,
                format!("map {name} exists: another node made it"),
            ));
        }
        self.map(name).await
    }

    /// A map as it is, to be shared from now on: with its uuid and revision. Nobody changes it meanwhile.
    ///
    /// # Errors
    /// As for [`MapService::snapshot_map`].
    pub async fn to_share(&self, name: &MapName) -> Result<NewMap, ServiceError> {
        let (map, file) = (self.map(name).await?, self.snapshot_map(name).await?);
        let core = Arc::clone(&map.map);
        let base = tokio::task::spawn_blocking(move || base_of(&core)).await;
        let base = base.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()));
        Ok(NewMap { uuid: map.uuid, base, file: file.bytes })
    }

    /// From now on a server by itself does not open the data folder any more: a cluster adopts maps of it. A node does,
    /// whichever is first, and [`Adoption`](crate::Adoption) opens it to adopt more.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn note_adopted(&self) -> Result<(), ServiceError> {
        self.inner.catalog.note_adopted()
    }

    /// Deletes a map on all nodes, or on this one where only this one has it; its last version here.
    pub(super) async fn delete_in(
        &self,
        cluster: &Cluster,
        name: &MapName,
    ) -> Result<MapVersion, ServiceError> {
        let map = self.map(name).await?;
        let version = map.version_now();
        match cluster.catalog.delete(name, map.uuid).await {
            // A map that was never taken into the cluster.
            Err(error) if error.reason == Reason::MapNotFound && map.lead() == Lead::NotJoined => {
                self.drop_copy(name, map.uuid).await?;
            }
            deleted => deleted?,
        }
        Ok(version)
    }
}

fn empty_map(settings: MapSettings) -> Result<NewMap, ServiceError> {
    let (uuid, map) = (Uuid::new_v4(), MultiResolutionMap::new(settings)?);
    let file = Snapshot::of(&map, uuid).encode();
    let file = file.map_err(|error| ServiceError::new(Reason::NotEncoded, error.to_string()))?;
    Ok(NewMap { uuid, base: base_of(&map), file: file.into() })
}

/// Where the log of a map begins that has none yet.
fn base_of(map: &MultiResolutionMap) -> Base {
    Base { revision: map.revision(), state: Some(map.state_hash()), ..Base::default() }
}
