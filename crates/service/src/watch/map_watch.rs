//! A watch of a map: where it is, and how its next message is made.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio_stream::Stream;

use super::backpressure::{Teller, stream_of};
use super::state_parts::StateParts;
use crate::commit::{BLOCKS_PER_PART, ChangeParts, Watched, WatchedChange, WatchedLevel};
use crate::error::ServiceError;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedSince};
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;

/// Changes that are read from the journal at once, and bytes of memory after which no other is added to them.
const BATCH_MAX: usize = 4096;
const BATCH_BYTES: usize = 4 << 20;

impl MapService {
    /// Watches a map.
    ///
    /// # Errors
    /// `NotFound` without such a map; `InvalidArgument` for a level that is none.
    pub async fn watch(&self, map: &MapName, request: WatchRequest) -> Result<Watch, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            if let WatchForm::Deltas { level } = request.form {
                map.check_level(level)?;
            }
            Ok(Watch::begin(self.clone(), map, request))
        };
        self.observed("Watch", Some(map), work, |_| Outcome::Read).await
    }
}

/// A watch of a map.
#[derive(Debug)]
pub struct Watch {
    service: MapService,
    map: Arc<HostedMap>,
    watched: Watched,
    _level: Option<WatchedLevel>,
    durable: watch::Receiver<u64>,
    /// The last revision that was told, or is being told; none where the whole state comes first.
    told: Option<u64>,
    /// What is being told.
    parts: Parts,
    /// Changes that were read from the journal and come next.
    read: VecDeque<Arc<WatchedChange>>,
    is_greeted: bool,
}

/// What a watcher is being told.
#[derive(Debug)]
enum Parts {
    Nothing,
    State(StateParts),
    Change(ChangeParts),
}

impl Parts {
    fn next(&mut self) -> Option<WatchEvent> {
        match self {
            Self::Nothing => None,
            Self::State(parts) => parts.next().map(WatchEvent::State),
            Self::Change(parts) => parts.next().map(WatchEvent::Change),
        }
    }
}

impl Watch {
    fn begin(service: MapService, map: Arc<HostedMap>, request: WatchRequest) -> Self {
        let WatchRequest { since, region, form, viewpoints } = request;
        let level = match form {
            WatchForm::Changes => None,
            WatchForm::Deltas { level } => Some(map.followers.recent.watch_level(level)),
        };
        let durable = map.followers.recent.durable();
        let head = *durable.borrow();
        // A revision that is not there, of another map, or of another history of this one, is out of reach.
        let is_here = |since: &WatchedSince| {
            let here = map.followers.recent.hashes_at(since.revision);
            let is_same = since.content_hash.is_none_or(|hash| here.is_some_and(|here| here.content == hash))
                && since.state_hash.is_none_or(|hash| here.is_some_and(|here| here.state == hash));
            since.map_uuid == map.uuid && since.revision <= head && is_same
        };
        let told = since.filter(is_here);
        let told = told.map(|since| since.revision);
        let (parts, read) = (Parts::Nothing, VecDeque::new());
        let watched = Watched { form, region, viewpoints };
        Self { service, map, watched, _level: level, durable, told, parts, read, is_greeted: false }
    }

    fn message(&mut self, event: WatchEvent) -> WatchMessage {
        self.is_greeted = true;
        // A heartbeat speaks of what was told, whatever has come this moment.
        let told = self.told.filter(|_| event == WatchEvent::Heartbeat);
        let head_revision = told.unwrap_or_else(|| *self.durable.borrow());
        let hashes = self.told.and_then(|told| self.map.followers.recent.hashes_at(told));
        let state_hash = hashes.map(|hashes| hashes.state);
        WatchMessage { map_uuid: self.map.uuid, head_revision, state_hash, event }
    }

    /// Begins to tell of the whole state, once it is durable.
    async fn begin_state(&mut self) -> Result<(), ServiceError> {
        let (map, inner) = (Arc::clone(&self.map), Arc::clone(&self.service.inner));
        let form = self.watched.form;
        let make = move |stop: StopSignal<'_>| map.whole_state(form, &inner.budget, stop);
        let state = self.service.inner.lanes.watch.run(&self.service.asker, make).await??;
        let revision = state.version.revision;
        let is_durable = tokio::select! {
            biased;
            durable = self.durable.wait_for(|durable| *durable >= revision) => durable.is_ok(),
            () = self.map.commit_queue.ended() => false,
        };
        if !is_durable {
            return Err(self.map.ended());
        }
        (self.told, self.parts) =
            (Some(revision), Parts::State(StateParts::of(state, self.watched, self.map.map.lattice())));
        Ok(())
    }

    /// Begins to tell of the change that made `revision`; where that is out of reach, the whole state is next.
    async fn begin_change(&mut self, revision: u64) -> Result<(), ServiceError> {
        let read = self.read.pop_front().filter(|change| change.revision == revision);
        let Some(change) = read.or_else(|| self.map.followers.recent.get(revision)) else {
            self.read_journal(revision).await?;
            if self.read.is_empty() {
                self.told = None;
            }
            return Ok(());
        };
        let (map, watched) = (Arc::clone(&self.map), self.watched);
        let asks_where = watched.viewpoints && watched.region.is_some() && change.has_viewpoint();
        let is_small = change.blocks() <= BLOCKS_PER_PART && !asks_where;
        let parts = move || change.parts(&watched, map.map.lattice());
        // What takes long keeps no thread of the runtime.
        let parts = match is_small {
            true => parts(),
            false => self.service.inner.lanes.watch.run(&self.service.asker, move |_| parts()).await?,
        };
        self.told = parts.is_some().then_some(revision);
        self.parts = parts.map_or(Parts::Nothing, Parts::Change);
        Ok(())
    }

    /// Reads changes from `revision` on, as far as they are kept.
    async fn read_journal(&mut self, revision: u64) -> Result<(), ServiceError> {
        self.read.clear();
        let folder = self.map.folder.clone().filter(|_| self.watched.form == WatchForm::Changes);
        let (Some(folder), head) = (folder, *self.durable.borrow()) else { return Ok(()) };
        let recent = Arc::clone(&self.map.followers.recent);
        let read = move |stop: StopSignal<'_>| {
            let (mut batch, mut bytes) = (VecDeque::new(), 0);
            // What is removed meanwhile is out of reach as well.
            for change in folder.changes_from(revision).into_iter().flatten().map_while(Result::ok) {
                let (revision, change) = change;
                if revision > head || stop.is_stopped() {
                    break;
                }
                stop.give_way();
                let hash = recent.hashes_at(revision).map(|hashes| hashes.content);
                let change = WatchedChange::of(revision, hash, change, Vec::new());
                bytes += change.memory_bytes();
                batch.push_back(Arc::new(change));
                if batch.len() >= BATCH_MAX || bytes >= BATCH_BYTES {
                    break;
                }
            }
            batch
        };
        self.read = self.service.inner.lanes.watch.run(&self.service.asker, read).await?;
        Ok(())
    }

    /// Waits for the next change; false where none came in a while.
    async fn wait_for_change(&mut self) -> Result<bool, ServiceError> {
        let heartbeat = Duration::from_secs_f64(self.service.limits().watch_heartbeat_s);
        tokio::select! {
            biased;
            _ = self.durable.changed() => Ok(true),
            () = self.map.commit_queue.ended() => Err(self.map.ended()),
            () = tokio::time::sleep(heartbeat) => Ok(false),
        }
    }

    /// The next message; it comes after `watch_heartbeat_s` at the latest, where the server is not busy.
    ///
    /// # Errors
    /// `NotFound` or `FailedPrecondition` once the map is deleted or replaced; `ResourceExhausted` where there is no
    /// memory for the whole state, or too many jobs wait. After an error comes no other message.
    pub async fn next(&mut self) -> Result<WatchMessage, ServiceError> {
        loop {
            if let Some(event) = self.parts.next() {
                return Ok(self.message(event));
            }
            self.parts = Parts::Nothing;
            let head = *self.durable.borrow_and_update();
            match self.told {
                None => self.begin_state().await?,
                Some(told) if told < head => self.begin_change(told + 1).await?,
                Some(_) if !self.is_greeted => return Ok(self.message(WatchEvent::Heartbeat)),
                Some(_) => {
                    if !self.wait_for_change().await? {
                        return Ok(self.message(WatchEvent::Heartbeat));
                    }
                }
            }
        }
    }

    /// The messages as a stream, which ends with its first error: that of `end`, once it comes, or `watch_stalled`
    /// where the client took no message for `watch_unread_max_s`.
    pub fn into_stream(
        self,
        end: impl Future<Output = ServiceError> + Send + 'static,
    ) -> impl Stream<Item = Result<WatchMessage, ServiceError>> + Send {
        let unread_max_s = self.service.limits().watch_unread_max_s;
        stream_of(self, unread_max_s, end)
    }
}

impl Teller for Watch {
    type Message = WatchMessage;

    async fn tell(&mut self) -> Result<WatchMessage, ServiceError> {
        self.next().await
    }
}
