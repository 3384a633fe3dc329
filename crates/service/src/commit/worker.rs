//! The worker of a map makes its changes: durable, then visible, then acknowledged.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::sync::{oneshot, watch};

use super::lead::Lead;
use super::recent_changes::RecentChanges;
use super::scan_turn::{ScanTurn, TurnLimits};
use super::stop::{Stop, outcome_unknown, revisions_used_up};
use super::submission::{
    Decided, Decision, Outcome, Prepared, Refusal, RobotLock, Submission, Waiting, record_of,
};
use super::watched_change::WatchedChange;
use crate::error::ServiceError;
use crate::replication::Member;
use crate::resources::Reservation;
use mrol_map::map::{Change, Committed, MapName, MultiResolutionMap, REVISION_MAX};
use mrol_map::util::{SharedDurations, StopSignal};
use mrol_store::{Durability, MapFolder, Pin, Record, StoreError, StoreSettings};

/// Changes that share one sync, at most.
pub(super) const GROUP_MAX: usize = 256;
/// How long a node may leave unsynced what the log of several nodes holds.
const SHARED_SYNC_INTERVAL: Duration = Duration::from_secs(1);
/// Revisions between two thinnings of the trajectory of a map in memory.
const THINNED_EVERY: u64 = 4096;

/// Where the worker of a map publishes each change that it made.
pub(crate) struct Published {
    /// The last revision, for those who wait for one.
    pub(crate) announced: watch::Sender<u64>,
    /// The last changes, for those who watch the map.
    pub(crate) recent: Arc<RecentChanges>,
    /// Which node makes its changes, for those who ask.
    pub(crate) lead: watch::Sender<Lead>,
}

/// What the changes of a map are made with, by one thread at a time.
pub(super) struct Worker {
    pub(super) name: MapName,
    pub(super) map: Arc<MultiResolutionMap>,
    pub(super) folder: Option<Arc<MapFolder>>,
    pub(super) published: Published,
    /// Its part in the log that several nodes share; none of a map that is this server's alone.
    pub(super) member: Option<Member>,
    /// The last revision that was made because the log has it, and not in this node's own turn.
    pub(super) received: u64,
    /// The log did not answer in this turn: what else waits in it is refused at once.
    pub(super) is_log_silent: bool,
    pub(super) stopped: Arc<OnceLock<Stop>>,
    durations: Arc<SharedDurations>,
    settings: StoreSettings,
    /// Since when something waits to be synced at an interval.
    unsynced: Option<Instant>,
    /// When the trajectory of a map in memory was thinned last.
    thinned: u64,
}

/// A change to be made, with its record and its waiter.
struct Pending {
    change: Change,
    record: Option<Record>,
    answer: oneshot::Sender<Outcome>,
    /// Kept until the change is visible.
    _robot_lock: Option<RobotLock>,
    _memory: Vec<Reservation>,
    _pin: Option<Pin>,
}

impl Worker {
    pub(super) fn new(
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        published: Published,
        stopped: Arc<OnceLock<Stop>>,
        durations: Arc<SharedDurations>,
        settings: &StoreSettings,
    ) -> Self {
        let thinned = map.revision();
        let settings = settings.clone();
        Self {
            name,
            map,
            folder,
            published,
            member: None,
            received: 0,
            is_log_silent: false,
            stopped,
            durations,
            settings,
            unsynced: None,
            thinned,
        }
    }

    /// Makes the changes that wait, in order; a run of known ones shares one sync.
    pub(super) fn commit(&mut self, waiting: Vec<Waiting>) {
        let mut group = Vec::new();
        self.is_log_silent = false;
        for Waiting { submission, answer, .. } in waiting {
            if let (Submission::Prepared(_) | Submission::Undecided(_), Err(refusal)) =
                (&submission, self.check_leads())
            {
                drop(answer.send(Err(refusal)));
                continue;
            }
            match submission {
                Submission::Prepared(prepared) => {
                    let Prepared { mut change, mut record, seen, if_empty, limits, robot_lock, reservation } =
                        *prepared;
                    if seen < self.received {
                        drop(answer.send(Err(Refusal::Stale)));
                        continue;
                    }
                    if if_empty {
                        self.commit_group(&mut group);
                        if !self.map.is_empty() {
                            drop(answer.send(Err(Refusal::Stale)));
                            continue;
                        }
                    }
                    if let Err(error) = self.settle(&mut change, &mut record, limits, &group) {
                        drop(answer.send(Err(Refusal::Failed(error))));
                        continue;
                    }
                    let (_robot_lock, _memory) = (Some(robot_lock), vec![reservation]);
                    group.push(Pending { change, record, answer, _robot_lock, _memory, _pin: None });
                }
                Submission::Undecided(decide) => {
                    self.commit_group(&mut group);
                    self.decide(decide, answer, &mut group);
                    self.commit_group(&mut group);
                }
                Submission::Shared(act) => {
                    self.commit_group(&mut group);
                    let done = self.act(act);
                    // Told before, so that whoever hears of it finds who leads by then.
                    self.tell_lead();
                    drop(answer.send(done));
                }
            }
        }
        self.commit_group(&mut group);
        self.tell_lead();
    }

    /// Tells whoever asks who makes the changes of a map that nodes share.
    fn tell_lead(&self) {
        if let Some(member) = &self.member {
            let now = Lead::of(member);
            self.published.lead.send_if_modified(|lead| std::mem::replace(lead, now.clone()) != now);
        }
    }

    /// Cuts a scan to what it may still do now that its turn comes.
    fn settle(
        &self,
        change: &mut Change,
        record: &mut Option<Record>,
        limits: TurnLimits,
        group: &[Pending],
    ) -> Result<(), ServiceError> {
        let Change::Insertion(scan) = &mut *change else { return Ok(()) };
        let before = group.iter().map(|pending| &pending.change).collect();
        let turn = ScanTurn { map: &self.map, recent: &self.published.recent, before };
        if turn.cut(scan, limits) && record.is_some() {
            *record = Some(record_of(change)?);
        }
        Ok(())
    }

    fn decide(&mut self, decide: Decision, answer: oneshot::Sender<Outcome>, group: &mut Vec<Pending>) {
        let unchanged = Committed::none(self.map.content_version());
        let caller_gone = || answer.is_closed();
        let decided = || match decide(&self.map, StopSignal::when(&caller_gone))? {
            Some(Decided { change, record, reserved, pin }) => {
                let record = match (record, &self.folder) {
                    (None, Some(_)) => Some(record_of(&change)?),
                    (record, _) => record,
                };
                Ok(Some((change, record, reserved, pin)))
            }
            None => Ok(None),
        };
        match decided() {
            Ok(Some((change, record, _memory, _pin))) => {
                group.push(Pending { change, record, answer, _robot_lock: None, _memory, _pin });
            }
            Ok(None) => drop(answer.send(self.confirm_unchanged().map(|()| unchanged))),
            Err(refusal) => drop(answer.send(Err(refusal))),
        }
    }

    /// Durable, then visible, then acknowledged: first the changes of a group are put in order, then they are made.
    fn commit_group(&mut self, group: &mut Vec<Pending>) {
        let left = usize::try_from(REVISION_MAX.saturating_sub(self.map.revision())).unwrap_or(usize::MAX);
        for Pending { answer, .. } in group.drain(left.min(group.len())..) {
            drop(answer.send(Err(Refusal::Failed(revisions_used_up(&self.name)))));
        }
        while !group.is_empty() {
            let begin = Instant::now();
            match self.order(group) {
                Ok(ordered) => self.make(group.drain(..ordered), begin),
                Err(refusal) => {
                    for Pending { answer, .. } in group.drain(..) {
                        drop(answer.send(Err(refusal.clone())));
                    }
                }
            }
        }
    }

    /// Puts the first changes of a group behind all that were made, durably; returns how many.
    fn order(&mut self, group: &[Pending]) -> Result<usize, Refusal> {
        if let Some(stop) = self.stopped.get() {
            return Err(Refusal::Failed(stop.refusal(&self.name)));
        }
        let records: Vec<&Record> = group.iter().filter_map(|pending| pending.record.as_ref()).collect();
        if self.member.is_some() {
            debug_assert_eq!(
                records.len(),
                group.len(),
                "a map that nodes share has a folder, and so records"
            );
            return self.order_among_nodes(&records);
        }
        self.append(&records)?;
        if let Some(folder) = self.folder.as_ref().filter(|it| it.settings().durability == Durability::Always)
        {
            folder.sync().map_err(|error| self.lost_track(&error))?;
        }
        Ok(group.len())
    }

    /// Makes changes that are in order: visible, then acknowledged.
    fn make(&mut self, ordered: std::vec::Drain<'_, Pending>, begin: Instant) {
        let last = ordered.len().saturating_sub(1);
        for (k, Pending { change, answer, .. }) in ordered.enumerate() {
            let durations = Arc::clone(&self.durations);
            self.apply(change, |committed| {
                // Counted before the last one hears of it, so that whoever was answered finds its commit in the
                // metrics.
                if k == last {
                    durations.record(begin.elapsed());
                }
                drop(answer.send(Ok(committed)));
            });
        }
        self.note_durable();
        self.thin_in_memory();
    }

    /// Applies a change and publishes it; `acknowledge` is told in between.
    pub(super) fn apply(&self, change: Change, acknowledge: impl FnOnce(Committed)) {
        let Published { announced, recent, .. } = &self.published;
        let (committed, levels) = self.map.committer().apply_noting(&change, recent.levels());
        debug_assert_ne!(committed.revision, *announced.borrow(), "every record makes a revision");
        announced.send_replace(committed.revision);
        acknowledge(committed);
        let change = WatchedChange::of(committed.revision, Some(committed.hash), change, levels);
        recent.push(change, self.map.state_hash());
    }

    /// Tells the map's watchers how far it is durable: what is in a log that nodes share is.
    pub(super) fn note_durable(&self) {
        let visible = self.map.revision();
        let own_folder = self.folder.as_ref().filter(|_| self.member.is_none());
        let durable = own_folder.map_or(visible, |folder| folder.used().durable.min(visible));
        self.published.recent.note_durable(durable);
    }

    /// Thins the trajectory of a map without a folder every now and then, as far behind the newest revision as undo
    /// would reach; that of others is thinned when undo reaches less far.
    fn thin_in_memory(&mut self) {
        let revision = self.map.revision();
        if self.folder.is_none() && revision - self.thinned >= THINNED_EVERY {
            let before = revision.saturating_sub(self.settings.undo_revisions);
            self.map.committer().thin(before, &self.settings.trajectory_spacing);
            self.thinned = revision;
        }
    }

    /// Appends records to the journal, where there is one.
    pub(super) fn append(&mut self, records: &[&Record]) -> Result<(), ServiceError> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        folder.append(records).map_err(|error| match error {
            // Nothing was written.
            StoreError::JournalStopped(_) | StoreError::Gone | StoreError::RevisionsUsedUp(_) => {
                self.stop(&error)
            }
            error => self.lost_track(&error),
        })?;
        self.unsynced.get_or_insert_with(Instant::now);
        Ok(())
    }

    /// Changes were handed to the journal, and nobody knows what became of them.
    pub(super) fn lost_track(&self, error: &StoreError) -> ServiceError {
        self.stop(error);
        outcome_unknown(&self.name, error)
    }

    /// From now on the map takes no changes: what the disk holds is unknown.
    fn stop(&self, error: &StoreError) -> ServiceError {
        if matches!(error, StoreError::Gone) {
            return self.stopped.get_or_init(|| Stop::Deleted).refusal(&self.name);
        }
        tracing::error!(map = %self.name, %error, "the journal failed: the map is read only from now on");
        self.stopped.get_or_init(|| Stop::Failed(error.to_string())).refusal(&self.name)
    }

    /// How long until what was written is to be synced.
    fn until_sync(&self) -> Option<Duration> {
        let interval = match self.folder.as_ref()?.settings().durability {
            Durability::Interval(interval) => interval,
            // The log has it; the folder is what a node need not read again.
            Durability::Always if self.member.is_some() => SHARED_SYNC_INTERVAL,
            Durability::Always => return None,
        };
        Some(interval.saturating_sub(self.unsynced?.elapsed()))
    }

    /// When what was written is to be synced; none where nothing is.
    pub(super) fn due_at(&self) -> Option<Instant> {
        Some(Instant::now() + self.until_sync()?)
    }

    pub(super) fn sync_if_due(&mut self) {
        if self.until_sync().is_some_and(|rest| rest.is_zero()) {
            self.sync();
        }
    }

    pub(super) fn sync(&mut self) {
        self.unsynced = None;
        if let (Some(folder), None) = (&self.folder, self.stopped.get())
            && let Err(error) = folder.sync()
        {
            self.stop(&error);
        }
        self.note_durable();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.stopped.get_or_init(|| Stop::Failed("a defect of the server ended its changes".into()));
        }
    }
}
