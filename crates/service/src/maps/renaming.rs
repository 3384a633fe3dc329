//! A map gets another name, on disk and in memory.

use std::sync::Arc;

use super::catalog::{Catalog, blocking};
use super::hosted_map::HostedMap;
use super::opening::not_stored;
use crate::caller::Reachable;
use crate::error::{Reason, ServiceError};
use crate::work::Asker;

impl Catalog {
    /// Gives the map `name` the name `to`, which is free; its uuid, its revision and its robots stay. On disk it has
    /// one of the two names at every moment. Whoever waits for the map under its former name is told that it was
    /// renamed.
    pub(crate) async fn rename(
        self: &Arc<Self>,
        name: &Reachable,
        to: &Reachable,
        asker: &Asker,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        // Whoever has the turn waits for no map that is opened.
        self.get(name, asker).await?;
        self.check_name_free(to)?;
        let _writing = self.turn_to_write().await?;
        let old = self.get(name, asker).await?;
        old.check_not_shared()?;
        self.check_name_free(to)?;
        let (data_dir, to, settings) = (self.data_dir.clone(), to.name().clone(), self.settings.clone());
        let (threads, catalog) = (Arc::clone(&self.commit_threads), Arc::clone(self));
        blocking(move || {
            let mut unsynced = None;
            if let (Some(data_dir), Some(folder)) = (&data_dir, &old.folder)
                && let Err(error) = data_dir.rename(folder, &to)
            {
                if !data_dir.has_name(folder, &to) {
                    return Err(not_stored(error));
                }
                unsynced = Some(error);
            }
            // Changes that were on their way until now are in the map, and in its folder under its new name.
            old.commit_queue.end_renamed();
            let renamed = Arc::new(old.renamed(&threads, to.clone(), &settings));
            let mut maps = catalog.maps.write();
            maps.open.remove(&old.name);
            catalog.serve(&mut maps, &renamed);
            drop(maps);
            tracing::info!(map = %old.name, %to, "renamed");
            unsynced.map_or(Ok(renamed), |error| {
                let message = format!(
                    "map {} is called {to} now, but the disk did not say that this outlives a loss of power ({error}): \
                     look which name it has after the next restart",
                    old.name
                );
                Err(ServiceError::new(Reason::OutcomeUnknown, message))
            })
        })
        .await
    }

    /// Refuses a name that a map has, one that could not be opened among them.
    fn check_name_free(&self, to: &Reachable) -> Result<(), ServiceError> {
        let to = to.name();
        if !self.maps.read().taken().any(|taken| taken == to) {
            return Ok(());
        }
        let message = format!(
            "to must be a name that no map has, and map {to} exists: take another name, or delete it first"
        );
        Err(ServiceError::new(Reason::MapExists, message))
    }
}
