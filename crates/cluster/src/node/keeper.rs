//! Keeps this node's copy of one map.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc as std_mpsc;
use std::time::Duration;

use bytes::Bytes;
use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use mrol_service::{Lead, MapService, Reason, ServiceError};
use tokio::sync::watch;
use uuid::Uuid;

use super::blocking::{blocking, no_quorum};
use super::choice::{Choice, Known, choose};
use super::claimed::LOOKED_EVERY;
use super::cutting::Cutting;
use super::heart::Pulse;
use super::release::Release;
use super::settings::BaseLimits;
use super::so_far::SoFar;
use super::view::View;
use crate::catalog::Placement;
use crate::following::Following;
use crate::jetstream_log::JetStreamLog;
use crate::store::ClusterStore;

/// Pause before a copy is tried again.
const PAUSE: Duration = Duration::from_secs(1);

/// Keeps this node's copy of one map: takes it in where it has none, shares it by its log, and leads it where it is to.
/// Where the node is to hold the map no more, drops the copy once others have what it has.
pub(super) struct Keeper {
    pub(super) node: NodeName,
    /// Version of the records that it writes.
    pub(super) record_version: u32,
    /// When it puts a new base.
    pub(super) bases: BaseLimits,
    pub(super) service: MapService,
    pub(super) joined: ClusterStore,
    pub(super) name: MapName,
    pub(super) uuid: Uuid,
    /// Which nodes hold the map, and which of them is to lead it whenever it can.
    pub(super) placement: watch::Receiver<Placement>,
    pub(super) view: watch::Receiver<View>,
    pub(super) pulse: std_mpsc::Sender<Pulse>,
    /// How often this node took a map over.
    pub(super) takeovers: Arc<AtomicU64>,
}

impl Keeper {
    /// Keeps it until it is aborted, or the node has no copy any more.
    pub(super) async fn keep(mut self) {
        loop {
            let Some(log) = self.shared().await else { return };
            let _following = Following::begin(self.service.clone(), self.name.clone(), &log);
            let Ok(lead) = self.service.lead_of(&self.name).await else { return };
            match self.lead_where_due(lead, log).await {
                Ended::Behind => tokio::time::sleep(PAUSE).await,
                Ended::Gone => return,
            }
        }
    }

    /// Takes a copy in where there is none, and shares it by its log, again and again until that is done; none where
    /// this node has none and is to hold none.
    async fn shared(&self) -> Option<Arc<JetStreamLog>> {
        let mut last_said = None;
        loop {
            let error = match self.share().await {
                Ok(log) => return log,
                Err(error) => error,
            };
            if last_said.as_ref() != Some(&error.message) {
                tracing::warn!(map = %self.name, why = error.message, "this node has no copy of the map that follows its log");
                last_said = Some(error.message);
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    fn is_holder(&self) -> bool {
        self.placement.borrow().holders.contains(&self.node)
    }

    /// Takes a copy in where there is none, and shares it by its log; none where there is none and this node is to hold
    /// none.
    async fn share(&self) -> Result<Option<Arc<JetStreamLog>>, ServiceError> {
        match self.service.uuid_of_copy(&self.name).await? {
            Some(uuid) if uuid == self.uuid => {}
            _ if !self.is_holder() => return Ok(None),
            Some(other) => {
                tracing::error!(
                    map = %self.name, %other, listed = %self.uuid,
                    "this node has another map of this name than the cluster: it is kept under another name"
                );
                self.load_base(true).await?;
            }
            None => self.load_base(false).await?,
        }
        let (engine, uuid) = (self.joined.engine.clone(), self.uuid);
        let log = blocking(move || JetStreamLog::create(&engine, uuid)).await;
        let log = Arc::new(log.map_err(|error| no_quorum(&error))?);
        let shared = self.service.share_map(&self.name, log.clone(), self.node.clone()).await;
        match shared {
            // It follows once the log answers, or tells that it has parted from it.
            Err(error) if error.reason == Reason::NoQuorum => Ok(Some(log)),
            Err(error) if error.reason == Reason::HistoriesDiffer => {
                self.load_if_behind(&log).await?;
                Ok(Some(log))
            }
            shared => shared.map(|_| Some(log)),
        }
    }

    /// Loads the base where this node's copy is further behind than the log begins.
    async fn load_if_behind(&self, log: &Arc<JetStreamLog>) -> Result<(), ServiceError> {
        let (pointers, uuid) = (self.joined.pointers.clone(), self.uuid);
        let base = blocking(move || pointers.read(uuid)).await.map_err(|error| no_quorum(&error))?;
        let own = self.service.version_of(&self.name).await?.revision;
        let Some((base, _)) = base.filter(|(base, _)| base.revision > own) else { return Ok(()) };
        tracing::warn!(map = %self.name, own, base = base.revision, "this node's copy is behind where the log begins: the \
                       base takes its place");
        self.load_base(true).await?;
        match self.service.share_map(&self.name, log.clone(), self.node.clone()).await {
            Err(error) if error.reason != Reason::NoQuorum => Err(error),
            _ => Ok(()),
        }
    }

    async fn load_base(&self, replace: bool) -> Result<(), ServiceError> {
        let (joined, uuid) = (self.joined.clone(), self.uuid);
        let fetched = blocking(move || {
            let base = joined.pointers.read(uuid)?;
            base.map(|(base, _)| joined.bases.fetch(uuid, &base)).transpose()
        });
        let file = fetched.await.map_err(|error| no_quorum(&error))?;
        let file = file.ok_or_else(|| no_quorum(&format!("map {} has no base", self.name)))?;
        self.service.copy_map(self.name.clone(), uuid, Bytes::from(file), replace).await.map(drop)
    }

    /// Looks with each beat, and whenever the log names another node, whether this one is to lead; until the copy is
    /// gone, or the log begins behind what it has.
    async fn lead_where_due(&mut self, mut lead: watch::Receiver<Lead>, log: Arc<JetStreamLog>) -> Ended {
        let mut cutting = Cutting::of(self.joined.clone(), log, self.uuid, self.bases);
        let (mut so_far, mut release, mut last_said) = (SoFar::default(), None, None);
        loop {
            let view = self.view.borrow_and_update().clone();
            let now = lead.borrow_and_update().clone();
            let Ok(version) = self.service.version_of(&self.name).await else { return Ended::Gone };
            if self.service.is_behind_log(&self.name).await.unwrap_or(false) {
                return Ended::Behind;
            }
            let noted = so_far.note(self.uuid, &now, &view);
            if noted.is_claimed {
                _ = self.pulse.send(Pulse::Beat);
            }
            if noted.is_doubtful {
                tracing::warn!(map = %self.name, revision = version.revision, "this node cannot tell whether its copy has the \
                               history of the map's log: it takes over from nobody, and is not ready");
            }
            let placement = self.placement.borrow_and_update().clone();
            let known = Known {
                own: &self.node,
                map: self.uuid,
                revision: version.revision,
                sequence_before: so_far.before().map_or(0, |before| before.sequence),
                lead: &now,
                placement: &placement,
                view: &view,
                waited: so_far.waited(&view),
                claimed_at: so_far.claimed.at,
                record_version: self.record_version,
            };
            let no_room = view.without_room(self.uuid);
            if self.service.set_no_room(&self.name, no_room).await.is_err() {
                return Ended::Gone;
            }
            let choice = choose(&known);
            self.act(choice, &view, &now, &mut last_said).await;
            if let Lead::Shared { is_here: true, sequence, .. } = &now {
                let heads = view.holders(self.uuid).map(|(_, head)| head.sequence);
                let needed = heads.min().unwrap_or(*sequence);
                cutting.look(&self.service, &self.name, needed.min(*sequence)).await;
            }
            if placement.holders.contains(&self.node) {
                release = None;
            } else {
                let release = release.get_or_insert_with(Release::default);
                let is_due = release.is_due(self.uuid, &placement.holders, &view, so_far.before());
                if is_due && self.is_copy_of_others(&now) && self.drop_copy(&placement).await {
                    return Ended::Gone;
                }
            }
            tokio::select! {
                changed = self.view.changed() => {
                    if changed.is_err() {
                        return Ended::Gone;
                    }
                    so_far.note_progress(&lead.borrow(), version.revision, &self.view.borrow());
                }
                () = tokio::time::sleep(LOOKED_EVERY), if so_far.claimed.waits(&now) => {
                    so_far.claimed.looks += 1;
                    _ = self.pulse.send(Pulse::Beat);
                }
                () = leader_changed(&mut lead, &now) => {}
                _ = self.placement.changed() => {}
            }
        }
    }

    /// True where this node follows, and has nothing that the log has not.
    fn is_copy_of_others(&self, lead: &Lead) -> bool {
        let follows = matches!(lead, Lead::Shared { leader: Some(_), is_here: false, .. });
        let shared = self.service.shared_maps();
        let own = shared.iter().find(|map| map.name == self.name);
        follows && own.is_some_and(|map| map.failure.is_none())
    }

    /// Drops this node's copy, unless the list names other holders by now; true once it is gone.
    async fn drop_copy(&self, placement: &Placement) -> bool {
        let catalog = self.joined.catalog.clone();
        let Ok((listing, _)) = blocking(move || catalog.read()).await else { return false };
        let entry = listing.map(&self.name).filter(|entry| entry.uuid == self.uuid);
        if entry.is_none_or(|entry| entry.holders() != placement.holders) {
            return false;
        }
        match self.service.leave_to_others(&self.name, self.uuid).await {
            Ok(()) => {
                tracing::info!(map = %self.name, "other nodes hold the map: this one has dropped its copy")
            }
            Err(error) => {
                tracing::warn!(map = %self.name, why = error.message, "the copy stays, which others hold by now");
                return false;
            }
        }
        true
    }

    /// Does what was chosen; `last_said` is why that was not done before.
    async fn act(&self, choice: Choice, view: &View, lead: &Lead, last_said: &mut Option<String>) {
        let done = match choice {
            Choice::Stay => return,
            Choice::Claim => {
                let epoch = match lead {
                    Lead::Shared { epoch, .. } => Some(*epoch),
                    _ => None,
                };
                self.service.claim_map(&self.name, epoch).await
            }
            Choice::Open(claim) => {
                let live = view.holders(self.uuid).map(|(node, head)| (node.clone(), head.revision));
                let led = self.service.open_map(&self.name, claim, live.collect()).await;
                if led.is_ok() {
                    self.takeovers.fetch_add(1, Ordering::Relaxed);
                }
                led
            }
            Choice::HandOver(node) => {
                tracing::info!(map = %self.name, %node, "hands over");
                self.service.hand_map_over(&self.name, node).await
            }
        };
        let said = done.err().map(|error| error.message);
        if let Some(why) = said.as_ref().filter(|_| said != *last_said) {
            tracing::warn!(map = %self.name, why, "the lead stays where it is");
        }
        *last_said = said;
    }
}

/// Why a node ends looking whether it is to lead.
enum Ended {
    /// The copy is gone, or the node ends.
    Gone,
    /// The log begins behind what the copy has.
    Behind,
}

/// Waits until the log names another node, or this one has taken over or lost the lead.
async fn leader_changed(lead: &mut watch::Receiver<Lead>, before: &Lead) {
    let of = |lead: &Lead| match lead {
        Lead::Shared { leader, is_here, claim, .. } => Some((leader.clone(), *is_here, *claim)),
        _ => None,
    };
    let before = of(before);
    if lead.wait_for(|lead| of(lead) != before).await.is_err() {
        std::future::pending().await
    }
}
