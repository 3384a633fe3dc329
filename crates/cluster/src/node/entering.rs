//! Maps are entered into the cluster's list and deleted, for the operations of the service.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use mrol_service::{Later, MapElsewhere, MapHolder, NewMap, Reason, ServiceError, SharedCatalog};
use tokio::sync::{Mutex, mpsc, oneshot, watch};
use tokio::time::timeout;
use uuid::Uuid;

use super::blocking::{blocking, no_quorum, try_again};
use super::keepers::Wish;
use super::room::{holders, knows_others};
use super::settings::NodeSettings;
use super::view::{Seen, View};
use crate::beats::BEAT_EVERY;
use crate::catalog::{CatalogError, Holders, Listing, MapEntry};
use crate::store::{ClusterStore, EnterError};

/// Enters maps into the cluster's list and deletes them.
#[derive(Debug)]
pub(super) struct Entering {
    node: NodeName,
    /// How many nodes hold a map that is made here; 0 where all do.
    copies: usize,
    /// True where this node serves by TLS: it sends nobody, and nobody's key, to an address in the clear.
    is_secured: bool,
    /// None before NATS has answered.
    joined: Arc<OnceLock<ClusterStore>>,
    wishes: mpsc::UnboundedSender<Wish>,
    view: watch::Receiver<View>,
    /// The maps of the cluster, as the keepers have read them.
    list: watch::Receiver<Listing>,
    /// The list as it was read last for a map that this node has no copy of, and when.
    looked: Mutex<Option<(Instant, Result<Listing, CatalogError>)>>,
}

/// How long a list that was read answers for maps that this node has no copy of: names that nobody has cost NATS a few
/// questions a second, whoever asks for them.
const LOOKED_FOR: Duration = Duration::from_millis(200);
/// How long a request waits for a copy of a map that another node has just made.
const COPIED_WITHIN: Duration = Duration::from_secs(5);
/// How long this node may take to do its part of what is decided, and how much longer for each megabyte that a map file
/// has before compression: it is fetched, read and written.
const DONE_WITHIN: Duration = Duration::from_secs(20);
const LONGER_A_MEGABYTE: Duration = Duration::from_secs(2);
/// How long a map that some nodes are to hold waits until it is known which of them are live: a node that was just
/// started sees after four beats who is gone.
const SETTLED_WITHIN: Duration = BEAT_EVERY.saturating_mul(6);

impl Entering {
    pub(super) fn new(
        settings: &NodeSettings,
        joined: Arc<OnceLock<ClusterStore>>,
        wishes: mpsc::UnboundedSender<Wish>,
        view: watch::Receiver<View>,
        list: watch::Receiver<Listing>,
    ) -> Self {
        let (node, copies) = (settings.name.clone(), settings.copies);
        let is_secured = settings.http.starts_with("https://");
        Self { node, copies, is_secured, joined, wishes, view, list, looked: Mutex::default() }
    }

    fn joined(&self) -> Result<ClusterStore, ServiceError> {
        if self.view.borrow().is_unheard {
            return Err(no_quorum(&"this node's beats are not heard"));
        }
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

    /// What is listed of a map now; none where it is not listed.
    ///
    /// # Errors
    /// `NoQuorum` where that is not known.
    async fn listed(&self, name: &MapName) -> Result<Option<MapEntry>, ServiceError> {
        let mut looked = self.looked.lock().await;
        let is_new = |(at, _): &(Instant, _)| at.elapsed() < LOOKED_FOR;
        if !looked.as_ref().is_some_and(is_new) {
            let joined = self.joined()?;
            // That it could not be read holds as long: whoever waits behind does not ask again.
            let read = blocking(move || joined.catalog.read()).await.map(|(listing, _)| listing);
            *looked = Some((Instant::now(), read));
        }
        match looked.as_ref() {
            Some((_, Ok(listing))) => Ok(listing.map(name).cloned()),
            Some((_, Err(error))) => Err(told(name, error.clone())),
            None => Ok(None),
        }
    }

    /// The nodes that are to hold a map which is made here, once it is known which of them are live.
    async fn holders_of_new(&self) -> Result<Holders, ServiceError> {
        if self.copies == 0 {
            return Ok(Holders::All);
        }
        let mut view = self.view.clone();
        let settled = timeout(SETTLED_WITHIN, view.wait_for(|view| knows_others(self.copies, view))).await;
        match settled {
            Ok(Ok(view)) => Ok(holders(self.copies, &self.node, &view)),
            _ => Err(try_again("this node has not seen yet which of the others are live")),
        }
    }

    async fn enter_map(&self, name: &MapName, new: NewMap) -> Result<bool, ServiceError> {
        let (joined, of, uuid) = (self.joined()?, name.clone(), new.uuid);
        let holders = self.holders_of_new().await?;
        let within = DONE_WITHIN + LONGER_A_MEGABYTE * (new.body_bytes() >> 20) as u32;
        let entered = blocking(move || -> Result<(Uuid, Option<MapEntry>), ServiceError> {
            let there = joined.enter(&of, &new, &holders).map_err(|error| match error {
                EnterError::NotPut(why) => no_quorum(&why),
                EnterError::Catalog(error) => told(&of, error),
            })?;
            // Another node has made it, and not for this one.
            let (listing, _) = match there == uuid {
                true => return Ok((there, None)),
                false => joined.catalog.read().map_err(|error| told(&of, error))?,
            };
            Ok((there, listing.map(&of).cloned()))
        });
        let (there, entry) = entered.await?;
        if let Some(entry) = entry {
            self.check_held_here(name, &entry)?;
        }
        self.wait(name, there, true, within).await?;
        Ok(there == uuid)
    }

    /// The live nodes that hold a map, of others: those that have a copy first, and of these the one that leads.
    fn live_holders(&self, entry: &MapEntry) -> Vec<MapHolder> {
        let (view, holders) = (self.view.borrow(), entry.holders());
        let others = view.others.iter().filter(|(node, seen)| seen.is_live && holders.contains(node));
        let mut live: Vec<(&NodeName, &Seen)> = others.collect();
        live.sort_by_key(|(_, Seen { beat, .. })| {
            let head = beat.maps.get(&entry.uuid).filter(|head| !head.is_parted);
            (head.is_none(), head.is_none_or(|head| !head.leads))
        });
        let holder = |(node, Seen { beat, .. }): (&NodeName, &Seen)| MapHolder {
            node: node.to_string(),
            http: beat.http.clone(),
            grpc: beat.grpc.clone(),
        };
        let is_allowed = |holder: &MapHolder| {
            !self.is_secured || [&holder.http, &holder.grpc].iter().all(|at| at.starts_with("https://"))
        };
        live.into_iter().map(holder).filter(is_allowed).collect()
    }

    /// Refuses a map that other nodes hold, with the addresses of those that are live.
    fn check_held_here(&self, name: &MapName, entry: &MapEntry) -> Result<(), ServiceError> {
        let holders = entry.holders();
        if holders.contains(&self.node) {
            return Ok(());
        }
        let live = self.live_holders(entry);
        if live.is_empty() {
            let also = if self.is_secured { " and serves by TLS, as this one does" } else { "" };
            return Err(try_again(&format!(
                "none of the nodes that hold map {name} ({holders}) is live{also}"
            )));
        }
        Err(ServiceError::map_elsewhere(name, live))
    }

    /// The refusal of a map that this node is to hold and has no copy of yet: with the addresses of those that have
    /// one.
    fn not_copied_yet(&self, name: &MapName, entry: &MapEntry) -> ServiceError {
        let has_copy = |holder: &MapHolder| {
            let view = self.view.borrow();
            view.holders(entry.uuid).any(|(node, _)| node.as_str() == holder.node)
        };
        let with_copy: Vec<MapHolder> = self.live_holders(entry).into_iter().filter(has_copy).collect();
        match with_copy.is_empty() {
            true => try_again(&format!("this node has no copy of map {name} yet, and no other that is live")),
            false => ServiceError::map_elsewhere(name, with_copy),
        }
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
            let Some(entry) = self.listed(name).await? else { return Ok(false) };
            self.check_held_here(name, &entry)?;
            let waited = timeout(COPIED_WITHIN, self.wait(name, entry.uuid, true, COPIED_WITHIN)).await;
            match waited {
                Ok(Ok(())) => Ok(true),
                // It was deleted meanwhile; or it is there, and this node is still loading it, or cannot.
                _ => match self.listed(name).await? {
                    None => Ok(false),
                    Some(entry) => {
                        self.check_held_here(name, &entry)?;
                        Err(self.not_copied_yet(name, &entry))
                    }
                },
            }
        })
    }

    fn held_elsewhere(&self) -> Vec<MapElsewhere> {
        let list = self.list.borrow();
        let others = list.maps().filter(|(_, entry)| !entry.holders().contains(&self.node));
        others.map(|(name, entry)| MapElsewhere { name, holders: self.live_holders(entry) }).collect()
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
