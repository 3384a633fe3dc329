//! Maps that several nodes share: what a node is told to do about one of them.

use std::sync::Arc;

use bytes::Bytes;
use tokio::sync::{oneshot, watch};
use uuid::Uuid;

use super::map_file::from_file;
use super::operations::run_to_completion;
use crate::cluster::NoRoom;
use crate::commit::{Lead, Refusal, SharedAct, Stop, Submission};
use crate::error::{ErrorCode, Reason, ServiceError};
use crate::map_service::{MapService, commit_thread_ended};
use crate::maps::{BuiltMap, HostedMap, snapshot_bytes};
use crate::replication::{Base, NodeName, ReplicatedLog};
use crate::request::MapVersion;
use crate::work::Requester;
use mrol_map::map::{Committed, MapName};
use mrol_map::util::StopSignal;

/// A node's copy of a map that others share too.
#[derive(Debug, Clone)]
pub struct SharedMap {
    /// Its name here.
    pub name: MapName,
    /// Its version here.
    pub version: MapVersion,
    /// Which node makes its changes, as far as is known here.
    pub lead: Lead,
    /// Why it takes no changes here any more.
    pub failure: Option<String>,
    /// True where that is another history than the log has, and not a disk that failed.
    pub has_diverged: bool,
}

impl MapService {
    /// The copies that this node has of maps, by name: those that it shares and those that have not joined their log.
    pub fn shared_maps(&self) -> Vec<SharedMap> {
        let describe = |map: Arc<HostedMap>| SharedMap {
            name: map.name.clone(),
            // Before the version: a node that has read a claim has made at least what came before it.
            lead: map.lead(),
            version: map.version_now(),
            failure: map.failure().map(str::to_owned),
            has_diverged: map.has_diverged(),
        };
        let maps = self.inner.catalog.within(&self.allowed_maps).into_iter();
        let mut shared: Vec<_> = maps.map(describe).filter(|map| map.lead != Lead::Alone).collect();
        shared.sort_unstable_by(|a, b| a.name.cmp(&b.name));
        shared
    }

    /// The uuid of this node's copy of a map; none where it has none.
    ///
    /// # Errors
    /// `MapUnavailable` where it has one that it cannot open.
    pub async fn uuid_of_copy(&self, name: &MapName) -> Result<Option<Uuid>, ServiceError> {
        match self.map_here(name).await {
            Ok(map) => Ok(Some(map.uuid)),
            Err(error) if error.code() == ErrorCode::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Takes in a copy of a map that another node has, as the same incarnation: under its uuid, to be shared by
    /// [`MapService::share_map`]. With `replace` it takes the place of an older copy of the same map, which is kept as
    /// `NAME-replaced-REVISION`.
    ///
    /// # Errors
    /// As for [`MapService::restore_map`].
    pub async fn copy_map(
        &self,
        name: MapName,
        map_uuid: Uuid,
        file: Bytes,
        replace: bool,
    ) -> Result<MapVersion, ServiceError> {
        let reachable = self.allowed_maps.check(&name)?;
        self.inner.budget.check_to_grow()?;
        let maps_max = self.limits().maps_max;
        self.inner.catalog.check_free(&reachable, maps_max, replace)?;
        let inner = Arc::clone(&self.inner);
        let build = move |stop: StopSignal<'_>| from_file(&file, &inner.settings.limits, &inner.budget, stop);
        let built = self.inner.lanes.map_files.run(&self.asker, build).await??;
        let built = BuiltMap { uuid: map_uuid, ..built };
        let (_, map) = self.inner.catalog.restore(reachable, built, maps_max, replace, &self.asker).await?;
        Ok(map.version_now())
    }

    /// Deletes this node's copy of a map that was deleted in the cluster, if it is the one of this uuid.
    ///
    /// # Errors
    /// As for [`MapService::delete_map`].
    pub async fn drop_copy(&self, name: &MapName, map_uuid: Uuid) -> Result<(), ServiceError> {
        self.drop_copy_as(name, map_uuid, Stop::Deleted).await
    }

    /// Deletes this node's copy of a map that other nodes hold, if it is the one of this uuid: whoever waits for the
    /// map hears `map_elsewhere`.
    ///
    /// # Errors
    /// As for [`MapService::delete_map`].
    pub async fn leave_to_others(&self, name: &MapName, map_uuid: Uuid) -> Result<(), ServiceError> {
        self.drop_copy_as(name, map_uuid, Stop::HeldElsewhere).await
    }

    async fn drop_copy_as(&self, name: &MapName, map_uuid: Uuid, why: Stop) -> Result<(), ServiceError> {
        if self.uuid_of_copy(name).await? != Some(map_uuid) {
            return Ok(());
        }
        let (inner, asker) = (Arc::clone(&self.inner), self.asker.clone());
        let reachable = self.allowed_maps.check(name)?;
        run_to_completion(async move { inner.catalog.delete(&reachable, why, &asker).await }).await.map(drop)
    }

    /// True of a copy that takes no changes since the log begins behind what it has: a newer copy is to take its place.
    ///
    /// # Errors
    /// `NotFound` without such a map.
    pub async fn is_behind_log(&self, name: &MapName) -> Result<bool, ServiceError> {
        Ok(self.map_here(name).await?.is_behind_log())
    }

    /// The version of a map, as it is now.
    ///
    /// # Errors
    /// `NotFound` without such a map.
    pub async fn version_of(&self, name: &MapName) -> Result<MapVersion, ServiceError> {
        Ok(self.map_here(name).await?.version_now())
    }

    /// Which node makes the changes of a map; the receiver hears when that is another.
    ///
    /// # Errors
    /// `NotFound` without such a map.
    pub async fn lead_of(&self, name: &MapName) -> Result<watch::Receiver<Lead>, ServiceError> {
        Ok(self.map_here(name).await?.commit_queue.lead())
    }

    /// Says which other node that holds a map has no room for more of it: what makes the map grow is refused here until
    /// there is none.
    ///
    /// # Errors
    /// `NotFound` without such a map.
    pub async fn set_no_room(&self, name: &MapName, no_room: Option<NoRoom>) -> Result<(), ServiceError> {
        self.map_here(name).await?.set_no_room(no_room);
        Ok(())
    }

    /// From now on a log that other nodes read too orders the changes of a map, and this server is its node `node`: it
    /// makes what the log has, and takes changes only where it leads ([`MapService::claim_map`]). To be called before
    /// anybody may change the map. It stays in memory, under its name, until the server ends.
    ///
    /// # Errors
    /// `NotFound` without such a map, `NoJournal` for one that is kept in memory only, `NoQuorum` where the log does
    /// not answer, and `HistoriesDiffer` where the log has another history of the map than this server's folder.
    pub async fn share_map(
        &self,
        name: &MapName,
        log: Arc<dyn ReplicatedLog>,
        node: NodeName,
    ) -> Result<MapVersion, ServiceError> {
        let map = self.map_here(name).await?;
        if map.folder.is_none() {
            return Err(map.no_journal("a map that nodes share"));
        }
        let join = SharedAct::Join { log, node, map: map.uuid };
        let joined = map.commit_queue.submit(&Requester::from(&self.asker), Submission::Shared(join))?;
        match self.outcome_of_act(&map, joined).await? {
            Some(version) => Ok(version),
            None => self.follow_map(name, None).await,
        }
    }

    /// Makes what the log of a shared map has; to be called whenever it may have more. Nothing is asked of the log
    /// where the message of the number `newest` is the last that this node read.
    ///
    /// # Errors
    /// As for [`MapService::share_map`].
    pub async fn follow_map(&self, name: &MapName, newest: Option<u64>) -> Result<MapVersion, ServiceError> {
        loop {
            if let Some(version) = self.act_on(name, SharedAct::Follow { newest }).await? {
                return Ok(version);
            }
        }
    }

    /// Claims to lead a shared map. `epoch` is that of [`Lead::Shared`] when this was chosen: where the log names
    /// another node in a later one, that one is followed. With none, the claim comes after whoever leads by then.
    ///
    /// # Errors
    /// As for [`MapService::share_map`]; `NotLeader` where another node was faster.
    pub async fn claim_map(&self, name: &MapName, epoch: Option<u64>) -> Result<MapVersion, ServiceError> {
        self.act_on(name, SharedAct::Claim { epoch }).await?.ok_or_else(went_on)
    }

    /// Takes over a shared map by this node's claim, whose id [`Lead::Shared`] tells, and gives its log what only this
    /// node has. `live` are the other nodes that are up and have not parted from the log, with the revisions that they
    /// had once they had read the claim: a node that is behind one of them does not take over.
    ///
    /// # Errors
    /// As for [`MapService::share_map`]; `NotLeader` where that was not the last claim, `NoQuorum` where another is
    /// ahead.
    pub async fn open_map(
        &self,
        name: &MapName,
        claim: Option<Uuid>,
        live: Vec<(NodeName, u64)>,
    ) -> Result<MapVersion, ServiceError> {
        self.act_on(name, SharedAct::Open { claim, live }).await?.ok_or_else(went_on)
    }

    /// Gives the lead of a shared map to another node.
    ///
    /// # Errors
    /// As for [`MapService::share_map`]; `NotLeader` where this node neither leads nor has claimed to.
    pub async fn hand_map_over(&self, name: &MapName, node: NodeName) -> Result<MapVersion, ServiceError> {
        self.act_on(name, SharedAct::HandOver(node)).await?.ok_or_else(went_on)
    }

    /// Where the log of a shared map can begin, with a map file of the map as it is there; none where the newest change
    /// is not whole yet. The map takes no changes while it is copied in memory.
    ///
    /// # Errors
    /// As for [`MapService::share_map`]; `ResourceExhausted` where there is no memory for the file.
    pub async fn log_base(&self, name: &MapName) -> Result<Option<(Base, Bytes)>, ServiceError> {
        let map = self.map_here(name).await?;
        let _reserved = self.inner.budget.reserve_transient(snapshot_bytes(&map.map), "a map file")?;
        let (tell, told) = oneshot::channel();
        self.act_on(name, SharedAct::Copy(tell)).await?;
        let Some((base, copy)) = told.await.map_err(commit_thread_ended)? else { return Ok(None) };
        let encode = move |_: StopSignal<'_>| copy.encode();
        let file = self.inner.lanes.map_files.run(&self.asker, encode).await?;
        let file = file.map_err(|error| ServiceError::new(Reason::NotEncoded, error.to_string()))?;
        Ok(Some((base, file.into())))
    }

    /// None where there is more to do in another turn.
    async fn act_on(&self, name: &MapName, act: SharedAct) -> Result<Option<MapVersion>, ServiceError> {
        let map = self.map_here(name).await?;
        let outcome = map.commit_queue.submit(&Requester::from(&self.asker), Submission::Shared(act))?;
        self.outcome_of_act(&map, outcome).await
    }

    async fn outcome_of_act(
        &self,
        map: &HostedMap,
        outcome: oneshot::Receiver<Result<Committed, Refusal>>,
    ) -> Result<Option<MapVersion>, ServiceError> {
        match outcome.await.map_err(commit_thread_ended)? {
            Ok(committed) => Ok(Some(map.version(committed.version()))),
            Err(Refusal::Failed(error)) => Err(error),
            Err(Refusal::Stale) => Ok(None),
        }
    }
}

fn went_on() -> ServiceError {
    ServiceError::new(Reason::NotLeader, "the map went on meanwhile: try again")
}
