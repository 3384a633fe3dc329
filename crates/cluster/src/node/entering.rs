//! Maps are entered into the cluster's list and deleted, for the operations of the service.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use mrol_map::map::MapName;
use mrol_service::{Later, NewMap, Reason, ServiceError, SharedCatalog};
use tokio::sync::{Mutex, mpsc, oneshot};
use tokio::time::timeout;
use uuid::Uuid;

use super::blocking::{blocking, no_quorum};
use super::keepers::Wish;
use crate::catalog::{CatalogError, Listing};
use crate::store::{ClusterStore, EnterError};

/// Enters maps into the cluster's list and deletes them.
#[derive(Debug)]
pub(super) struct Entering {
    /// None before NATS has answered.
    joined: Arc<OnceLock<ClusterStore>>,
    wishes: mpsc::UnboundedSender<Wish>,
    /// The list as it was read last for a map that this node has no copy of, and when.
    looked: Mutex<Option<(Instant, Result<Listing, CatalogError>)>>,
}

/// How long a list that was read answers for maps that this node has no copy of: names that nobody has cost NATS a few
/// questions a second, whoever asks for them.
const LOOKED_FOR: Duration = Duration::from_millis(200);
/// How long a request waits for a copy of a map that another node has just made.
const COPIED_WITHIN: Duration = Duration::from_secs(5);
/// How long this node may take to do its part of what is decided, and how much longer for each megabyte of a map file,
/// which it fetches, reads and writes.
const DONE_WITHIN: Duration = Duration::from_secs(20);
const LONGER_A_MEGABYTE: Duration = Duration::from_millis(500);

impl Entering {
    pub(super) fn new(joined: Arc<OnceLock<ClusterStore>>, wishes: mpsc::UnboundedSender<Wish>) -> Self {
        Self { joined, wishes, looked: Mutex::default() }
    }

    fn joined(&self) -> Result<ClusterStore, ServiceError> {
        self.joined
            .get()
            .cloned()
            .ok_or_else(|| no_quorum(&"it has not answered since this node was started"))
    }

    /// Waits until this node has done its part of what is decided already.
    async fn wait(
        &self,
        name: &MapName,
        uuid: Uuid,
        is_there: bool,
        within: Duration,
    ) -> Result<(), ServiceError> {
        let (told, heard) = oneshot::channel();
        let is_sent = self.wishes.send(Wish { name: name.clone(), uuid, is_there, within, told }).is_ok();
        if is_sent && heard.await.is_ok() {
            return Ok(());
        }
        let what = if is_there { "is in the cluster" } else { "is deleted in the cluster" };
        let message = format!("map {name} {what}, and this node has not followed yet: ask again soon");
        Err(ServiceError::new(Reason::OutcomeUnknown, message))
    }

    /// The uuid of a map in the list of now; none where it is not listed.
    ///
    /// # Errors
    /// `NoQuorum` where that is not known.
    async fn listed(&self, name: &MapName) -> Result<Option<Uuid>, ServiceError> {
        let mut looked = self.looked.lock().await;
        let is_new = |(at, _): &(Instant, _)| at.elapsed() < LOOKED_FOR;
        if !looked.as_ref().is_some_and(is_new) {
            let joined = self.joined()?;
            // That it could not be read holds as long: whoever waits behind does not ask again.
            let read = blocking(move || joined.catalog.read()).await.map(|(listing, _)| listing);
            *looked = Some((Instant::now(), read));
        }
        match looked.as_ref() {
            Some((_, Ok(listing))) => Ok(listing.map(name).map(|entry| entry.uuid)),
            Some((_, Err(error))) => Err(told(name, error.clone())),
            None => Ok(None),
        }
    }

    async fn enter_map(&self, name: &MapName, new: NewMap) -> Result<bool, ServiceError> {
        let (joined, of, uuid) = (self.joined()?, name.clone(), new.uuid);
        let within = DONE_WITHIN + LONGER_A_MEGABYTE * (new.file.len() >> 20) as u32;
        let entered = blocking(move || -> Result<Uuid, ServiceError> {
            joined.enter(&of, &new).map_err(|error| match error {
                EnterError::NotPut(why) => no_quorum(&why),
                EnterError::Catalog(error) => told(&of, error),
            })
        });
        let there = entered.await?;
        self.wait(name, there, true, within).await?;
        Ok(there == uuid)
    }

    async fn delete_map(&self, name: &MapName, uuid: Uuid) -> Result<(), ServiceError> {
        let (joined, of) = (self.joined()?, name.clone());
        let deleted = blocking(move || -> Result<(), ServiceError> {
            if !joined.catalog.delete(&of, uuid).map_err(|error| told(&of, error))? {
                let message = format!("map {of} is none of the cluster's");
                return Err(ServiceError::new(Reason::MapNotFound, message));
            }
            // No node can change it any more, even one that has not heard of it.
            if let Err(error) = joined.remove(uuid) {
                tracing::debug!(map = %of, error, "its log is still there");
            }
            Ok(())
        });
        deleted.await?;
        self.wait(name, uuid, false, DONE_WITHIN).await
    }
}

impl SharedCatalog for Entering {
    fn enter<'a>(&'a self, name: &'a MapName, new: NewMap) -> Later<'a, Result<bool, ServiceError>> {
        Box::pin(self.enter_map(name, new))
    }

    fn look_for<'a>(&'a self, name: &'a MapName) -> Later<'a, Result<bool, ServiceError>> {
        Box::pin(async move {
            let Some(uuid) = self.listed(name).await? else { return Ok(false) };
            let waited = timeout(COPIED_WITHIN, self.wait(name, uuid, true, COPIED_WITHIN)).await;
            Ok(waited.is_ok_and(|waited| waited.is_ok()))
        })
    }

    fn delete<'a>(&'a self, name: &'a MapName, uuid: Uuid) -> Later<'a, Result<(), ServiceError>> {
        Box::pin(self.delete_map(name, uuid))
    }
}

fn told(name: &MapName, error: CatalogError) -> ServiceError {
    match error {
        CatalogError::Unavailable(why) => no_quorum(&why),
        CatalogError::Unknown(why) => {
            let message = format!(
                "NATS did not acknowledge map {name} in its list of maps ({why}): look whether it is there"
            );
            ServiceError::new(Reason::OutcomeUnknown, message)
        }
        full @ CatalogError::Full => ServiceError::new(Reason::TooManyMaps, full.to_string()),
        // The maps of a node's callers have uuids that no map had before.
        taken @ (CatalogError::OtherName(_) | CatalogError::Deleted(_)) => {
            ServiceError::new(Reason::MapExists, taken.to_string())
        }
        damaged @ CatalogError::Damaged(_) => ServiceError::new(Reason::CatalogBusy, damaged.to_string()),
    }
}
