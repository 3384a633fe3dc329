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
use super::cutting::Cutting;
use super::heart::Pulse;
use super::settings::BaseLimits;
use super::view::View;
use crate::following::Following;
use crate::jetstream_log::JetStreamLog;
use crate::store::ClusterStore;

/// Pause before a copy is tried again.
const PAUSE: Duration = Duration::from_secs(1);
/// How often a node that has claimed looks at the beats of the others, and how many times: they beat as soon as they have
/// read its claim.
const LOOKED_EVERY: Duration = Duration::from_millis(100);
const LOOKS_MAX: u32 = 20;

/// A claim of this node.
#[derive(Debug, Clone, Copy, Default)]
struct Claimed {
    id: Option<Uuid>,
    /// Its beats before, those in between counted.
    beats_before: u64,
    /// A revision of the beats' bucket after it.
    at: Option<u64>,
    /// Looks at the beats since.
    looks: u32,
}

/// Keeps this node's copy of one map: takes it in where it has none, shares it by its log, and leads it where it is to.
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
    /// The node that is to lead the map whenever it can.
    pub(super) wished: watch::Receiver<Option<NodeName>>,
    pub(super) view: watch::Receiver<View>,
    pub(super) pulse: std_mpsc::Sender<Pulse>,
    /// How often this node took a map over.
    pub(super) takeovers: Arc<AtomicU64>,
}

impl Keeper {
    /// Keeps it until it is aborted, or there is no copy any more.
    pub(super) async fn keep(mut self) {
        loop {
            let log = self.shared().await;
            let _following = Following::begin(self.service.clone(), self.name.clone(), &log);
            let Ok(lead) = self.service.lead_of(&self.name).await else { return };
            match self.lead_where_due(lead, log).await {
                Ended::Behind => tokio::time::sleep(PAUSE).await,
                Ended::Gone => return,
            }
        }
    }

    /// Takes a copy in where there is none, and shares it by its log, again and again until that is done.
    async fn shared(&self) -> Arc<JetStreamLog> {
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

    /// Takes a copy in where there is none, and shares it by its log.
    async fn share(&self) -> Result<Arc<JetStreamLog>, ServiceError> {
        match self.service.uuid_of_copy(&self.name).await? {
            Some(uuid) if uuid == self.uuid => {}
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
            Err(error) if error.reason == Reason::NoQuorum => Ok(log),
            Err(error) if error.reason == Reason::HistoriesDiffer => {
                self.load_if_behind(&log).await?;
                Ok(log)
            }
            shared => shared.map(|_| log),
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

    /// Looks with each beat, and whenever the log names another node, whether this one is to lead; until the copy is gone,
    /// or the log begins behind what it has.
    async fn lead_where_due(&mut self, mut lead: watch::Receiver<Lead>, log: Arc<JetStreamLog>) -> Ended {
        let mut cutting = Cutting::of(self.joined.clone(), log, self.uuid, self.bases);
        let (mut waited_since, mut sequences, mut beats_then) = (None, [0; 2], 0);
        let (mut claimed, mut claim_told) = (Claimed::default(), None);
        loop {
            let view = self.view.borrow_and_update().clone();
            let now = lead.borrow_and_update().clone();
            let Ok(version) = self.service.version_of(&self.name).await else { return Ended::Gone };
            if self.service.is_behind_log(&self.name).await.unwrap_or(false) {
                return Ended::Behind;
            }
            let leader_is_seen = match &now {
                Lead::Shared { is_here: true, .. } => true,
                Lead::Shared { leader: Some(leader), .. } => {
                    view.holders(self.uuid).any(|(node, head)| node == leader && head.leads)
                }
                _ => false,
            };
            let since = *waited_since.get_or_insert(view.beats);
            if leader_is_seen {
                waited_since = None;
            }
            if let Lead::Shared { has_claimed, claim, .. } = now {
                if has_claimed {
                    claimed.note(claim, &view);
                } else if claim != claim_told {
                    // Whoever claimed waits for what this node has.
                    claim_told = claim;
                    _ = self.pulse.send(Pulse::Beat);
                }
            }
            let wished = self.wished.borrow_and_update().clone();
            let known = Known {
                own: &self.node,
                map: self.uuid,
                revision: version.revision,
                sequence_before: sequences[0],
                lead: &now,
                wished: wished.as_ref(),
                view: &view,
                waited: view.beats - since,
                claimed_at: claimed.at,
                record_version: self.record_version,
            };
            let choice = choose(&known);
            self.act(choice, &view, &now).await;
            if let Lead::Shared { is_here: true, sequence, .. } = &now {
                let heads = view.holders(self.uuid).map(|(_, head)| head.sequence);
                let needed = heads.min().unwrap_or(*sequence);
                cutting.look(&self.service, &self.name, needed.min(*sequence)).await;
            }
            tokio::select! {
                changed = self.view.changed() => {
                    if changed.is_err() {
                        return Ended::Gone;
                    }
                    let beats = self.view.borrow().beats;
                    let Lead::Shared { sequence, .. } = &*lead.borrow() else { continue };
                    if std::mem::replace(&mut beats_then, beats) != beats {
                        sequences = [sequences[1], *sequence];
                    }
                }
                () = tokio::time::sleep(LOOKED_EVERY), if claimed.waits(&now) => {
                    claimed.looks += 1;
                    _ = self.pulse.send(Pulse::Beat);
                }
                () = leader_changed(&mut lead, &now) => {}
                _ = self.wished.changed() => {}
            }
        }
    }

    async fn act(&self, choice: Choice, view: &View, lead: &Lead) {
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
        if let Err(error) = done {
            tracing::warn!(map = %self.name, why = error.message, "the lead stays where it is");
        }
    }
}

impl Claimed {
    /// Notes what this node sees that has claimed.
    fn note(&mut self, id: Option<Uuid>, view: &View) {
        if self.id != id {
            *self = Self { id, beats_before: view.all_beats, ..Self::default() };
        }
        // The first that is acknowledged may have begun before the claim. Where an older copy of the bucket was put back,
        // its revisions are smaller from then on.
        if view.all_beats >= self.beats_before + 2 {
            self.at = Some(self.at.map_or(view.revision, |at| at.min(view.revision)));
        }
    }

    /// True while the others' beats are looked at more often.
    fn waits(&self, lead: &Lead) -> bool {
        matches!(lead, Lead::Shared { is_here: false, has_claimed: true, .. }) && self.looks < LOOKS_MAX
    }
}

/// Why a node ends looking whether it is to lead.
enum Ended {
    /// The copy is gone, or the node ends.
    Gone,
    /// The log begins behind what the copy has.
    Behind,
}

/// Waits until there was a claim, or this node has taken over or lost the lead.
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
