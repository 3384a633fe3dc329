//! One keeper for each map of the cluster's list that this node holds.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc as std_mpsc;
use std::time::{Duration, Instant};

use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use mrol_service::{Lead, MapService, Reason, ServiceError};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinHandle;
use uuid::Uuid;

use super::blocking::blocking;
use super::heart::Pulse;
use super::keeper::Keeper;
use super::settings::{BaseLimits, NodeSettings};
use super::sweeping::Sweeping;
use super::view::View;
use crate::beat::Beat;
use crate::catalog::{Listing, Placement};
use crate::store::ClusterStore;

/// How often it is looked for it.
const LOOKED_EVERY: Duration = Duration::from_millis(10);
/// How long after a hint the list is read again, and how often.
const HEARD_AHEAD: Duration = Duration::from_millis(20);
const LOOKS_MAX: usize = 10;
/// How long a map that was deleted stays listed as such, at least.
const DELETED_FOR: Duration = Duration::from_secs(60);

/// What an operation waits for, once the list says so: a copy of a map that some node leads, or that there is none.
#[derive(Debug)]
pub(super) struct Wish {
    pub(super) name: MapName,
    pub(super) uuid: Uuid,
    /// True of a map that was entered, false of one that was deleted.
    pub(super) is_there: bool,
    /// How long that may take.
    pub(super) within: Duration,
    pub(super) told: oneshot::Sender<()>,
}

/// One keeper for each map of the cluster's list that this node holds, or has a copy of still.
pub(super) struct Keepers {
    node: NodeName,
    record_version: u32,
    bases: BaseLimits,
    service: MapService,
    joined: ClusterStore,
    view: watch::Receiver<View>,
    pulse: std_mpsc::Sender<Pulse>,
    /// Is told the list.
    list: watch::Sender<Listing>,
    /// How often this node took a map over.
    takeovers: Arc<AtomicU64>,
    kept: BTreeMap<MapName, Kept>,
    /// Revision of the list that was followed last.
    revision: u64,
    /// Maps that were deleted, since when this node knows.
    deleted: BTreeMap<Uuid, Instant>,
    sweeping: Sweeping,
}

struct Kept {
    uuid: Uuid,
    placement: watch::Sender<Placement>,
    task: JoinHandle<()>,
}

impl Drop for Kept {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Keepers {
    pub(super) fn new(
        settings: &NodeSettings,
        service: MapService,
        joined: ClusterStore,
        view: watch::Receiver<View>,
        pulse: std_mpsc::Sender<Pulse>,
        list: watch::Sender<Listing>,
        takeovers: Arc<AtomicU64>,
    ) -> Self {
        let NodeSettings { name: node, record_version, bases, .. } = settings.clone();
        let (kept, deleted) = (BTreeMap::new(), BTreeMap::new());
        let revision = 0;
        let sweeping = Sweeping::of(joined.clone(), bases.swept_every);
        Self {
            node,
            record_version,
            bases,
            service,
            joined,
            view,
            pulse,
            list,
            takeovers,
            kept,
            revision,
            deleted,
            sweeping,
        }
    }

    /// Reads the list with each beat, with each wish and whenever it was changed, until the wishes end.
    pub(super) async fn keep(mut self, mut wishes: mpsc::UnboundedReceiver<Wish>) {
        let mut hints = self.joined.catalog.hints(&self.joined.engine);
        let mut view = self.view.clone();
        let mut looks = 0;
        loop {
            // That it was changed is heard before every server of NATS has the change.
            while !self.follow_list().await && looks > 0 {
                looks -= 1;
                tokio::time::sleep(HEARD_AHEAD).await;
            }
            looks = 0;
            tokio::select! {
                wish = wishes.recv() => match wish {
                    Some(wish) => {
                        looks = LOOKS_MAX;
                        if wish.is_there && self.deleted.contains_key(&wish.uuid) {
                            continue;
                        }
                        tokio::spawn(fulfil(self.service.clone(), wish));
                    }
                    None => return,
                },
                _ = view.changed() => self.tidy().await,
                () = hints.next() => looks = LOOKS_MAX,
            }
        }
    }

    /// Does what the list says; true where that is another than before.
    async fn follow_list(&mut self) -> bool {
        let catalog = self.joined.catalog.clone();
        match blocking(move || catalog.read()).await {
            Ok((listing, revision)) => {
                let is_new = std::mem::replace(&mut self.revision, revision) != revision;
                // A copy that could not be dropped then is dropped now.
                self.follow(&listing).await;
                if is_new {
                    self.list.send_replace(listing);
                }
                is_new
            }
            Err(error) => {
                tracing::debug!(%error, "the list of maps was not read");
                false
            }
        }
    }

    async fn follow(&mut self, listing: &Listing) {
        let now = Instant::now();
        for uuid in listing.deleted() {
            self.deleted.entry(uuid).or_insert(now);
        }
        // One ends by itself where the node has no copy any more.
        let is_other = |name: &MapName, kept: &Kept| {
            kept.task.is_finished() || listing.map(name).is_none_or(|entry| entry.uuid != kept.uuid)
        };
        let ended: Vec<_> = self
            .kept
            .iter()
            .filter(|(name, kept)| is_other(name, kept))
            .map(|(name, _)| name.clone())
            .collect();
        for name in ended {
            drop(self.kept.remove(&name));
        }
        let mut copies = BTreeSet::new();
        for map in self.service.shared_maps() {
            if listing.is_deleted(map.version.map_uuid) {
                self.drop_copy(&map.name, map.version.map_uuid).await;
            } else {
                copies.insert((map.name, map.version.map_uuid));
            }
        }
        for (name, entry) in listing.maps() {
            let placement = entry.placement();
            match self.kept.get(&name) {
                Some(kept) => {
                    let is_other =
                        |there: &mut Placement| std::mem::replace(there, placement.clone()) != placement;
                    kept.placement.send_if_modified(is_other);
                }
                None if placement.holders.contains(&self.node)
                    || copies.contains(&(name.clone(), entry.uuid)) =>
                {
                    let kept = self.begin(&name, entry.uuid, placement);
                    self.kept.insert(name, kept);
                }
                None => {}
            }
        }
    }

    fn begin(&self, name: &MapName, uuid: Uuid, placement: Placement) -> Kept {
        let (placement, heard) = watch::channel(placement);
        let keeper = Keeper {
            node: self.node.clone(),
            record_version: self.record_version,
            bases: self.bases,
            service: self.service.clone(),
            joined: self.joined.clone(),
            name: name.clone(),
            uuid,
            placement: heard,
            view: self.view.clone(),
            pulse: self.pulse.clone(),
            takeovers: Arc::clone(&self.takeovers),
        };
        Kept { uuid, placement, task: tokio::spawn(keeper.keep()) }
    }

    async fn drop_copy(&self, name: &MapName, uuid: Uuid) {
        match self.service.drop_copy(name, uuid).await {
            Ok(()) => tracing::info!(map = %name, %uuid, "was deleted in the cluster, and here"),
            Err(error) => tracing::warn!(map = %name, %error, "was deleted in the cluster, and not here yet"),
        }
    }

    /// Takes away what is left at NATS. One of the nodes is enough.
    async fn tidy(&mut self) {
        let view = self.view.borrow().clone();
        // One that does not see the others, or is not the only one of its name, cannot tell which is the first.
        let is_blind = view.beats == 0 || view.is_unheard;
        if is_blind || view.others.iter().any(|(node, seen)| seen.is_live && *node < self.node) {
            return;
        }
        self.sweeping.look().await;
        // One that is gone may come back with a copy that its last beat did not have yet.
        if view.others.values().all(|seen| seen.is_live) {
            self.forget_deleted(&view).await;
        }
    }

    /// Takes away what is left at NATS of maps that were deleted, and forgets those that no node has a copy of.
    async fn forget_deleted(&mut self, view: &View) {
        let has = |Beat { maps, unjoined, .. }: &Beat, uuid: &Uuid| {
            maps.contains_key(uuid) || unjoined.contains_key(uuid)
        };
        let is_held = |uuid: &Uuid| view.others.values().any(|seen| has(&seen.beat, uuid));
        let due = |(uuid, since): (&Uuid, &Instant)| {
            (since.elapsed() > DELETED_FOR && !is_held(uuid)).then_some(*uuid)
        };
        let due: BTreeSet<Uuid> = self.deleted.iter().filter_map(due).collect();
        if due.is_empty() {
            return;
        }
        let joined = self.joined.clone();
        let cleared = blocking(move || -> Result<BTreeSet<Uuid>, String> {
            let removed = |uuid: &Uuid| match joined.remove(*uuid) {
                Ok(()) => true,
                Err(error) => {
                    tracing::debug!(%uuid, error, "what is left of a map that was deleted is not gone yet");
                    false
                }
            };
            let gone: BTreeSet<Uuid> = due.into_iter().filter(removed).collect();
            joined.catalog.forget(&gone).map_err(|error| error.to_string())?;
            Ok(gone)
        });
        match cleared.await {
            Ok(gone) => self.deleted.retain(|uuid, _| !gone.contains(uuid)),
            Err(error) => tracing::debug!(error, "maps that were deleted are not forgotten yet"),
        }
    }
}

/// Waits for what an operation wishes; where it does not come in time, the operation hears nothing.
async fn fulfil(service: MapService, wish: Wish) {
    let until = Instant::now() + wish.within;
    while Instant::now() < until && !wish.told.is_closed() {
        match is_fulfilled(&service, &wish).await {
            Ok(true) => {
                _ = wish.told.send(());
                return;
            }
            Err(error) if error.reason != Reason::MapNotFound => return,
            _ => tokio::time::sleep(LOOKED_EVERY).await,
        }
    }
}

async fn is_fulfilled(service: &MapService, wish: &Wish) -> Result<bool, ServiceError> {
    let has_copy = service.uuid_of_copy(&wish.name).await? == Some(wish.uuid);
    if !wish.is_there || !has_copy {
        return Ok(wish.is_there == has_copy);
    }
    let lead = service.lead_of(&wish.name).await?;
    let is_led = matches!(&*lead.borrow(), Lead::Shared { leader: Some(_), .. });
    Ok(is_led)
}
