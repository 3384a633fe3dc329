//! The thread of a map: durable, then visible, then acknowledged.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use super::{
    Decided, Decision, GROUP_MAX, Outcome, Prepared, Refusal, Stop, Submission, Told, Turn, Waiting,
    outcome_unknown, record_of, revisions_used_up,
};
use crate::map::{Change, Committed, MapName, MultiResolutionMap, REVISION_MAX};
use crate::mapping::Carving;
use crate::service::ServiceError;
use crate::service::recent_changes::WatchedChange;
use crate::service::resource_budget::Reservation;
use crate::store::{Durability, MapFolder, Pin, Record, StoreError, StoreSettings};
use crate::sync::mpsc::{Receiver, RecvTimeoutError};
use crate::util::{SharedDurations, StopSignal};
use crate::voxel::VoxelSet;

/// Revisions between two thinnings of the trajectory of a map in memory.
const THINNED_EVERY: u64 = 4096;

/// What a map's thread works with.
pub(super) struct Worker {
    name: MapName,
    map: Arc<MultiResolutionMap>,
    folder: Option<Arc<MapFolder>>,
    told: Told,
    stopped: Arc<OnceLock<Stop>>,
    durations: Arc<SharedDurations>,
    settings: StoreSettings,
    /// Since when something waits to be synced at an interval.
    unsynced: Option<Instant>,
    /// When the trajectory of a map in memory was thinned last.
    thinned: u64,
}

/// A change to be made, with its record and the one who waits.
struct Pending {
    change: Change,
    record: Option<Record>,
    answer: oneshot::Sender<Outcome>,
    /// Kept until the change is visible.
    _turn: Option<Turn>,
    _memory: Vec<Reservation>,
    _pin: Option<Pin>,
}

impl Worker {
    pub(super) fn new(
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        told: Told,
        stopped: Arc<OnceLock<Stop>>,
        durations: Arc<SharedDurations>,
        settings: &StoreSettings,
    ) -> Self {
        let thinned = map.revision();
        let settings = settings.clone();
        Self { name, map, folder, told, stopped, durations, settings, unsynced: None, thinned }
    }

    /// Makes changes until nobody can send one any more.
    pub(super) fn run(mut self, inbox: &Receiver<Waiting>) {
        loop {
            match self.next(inbox) {
                Ok(first) => {
                    let rest = inbox.try_iter().take(GROUP_MAX - 1);
                    let waiting: Vec<Waiting> = std::iter::once(first).chain(rest).collect();
                    self.commit(waiting);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.sync_if_due();
        }
        self.sync();
    }

    fn next(&self, inbox: &Receiver<Waiting>) -> Result<Waiting, RecvTimeoutError> {
        match self.until_sync() {
            Some(rest) => inbox.recv_timeout(rest),
            None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
        }
    }

    /// Makes the changes that wait, in order; a run of known ones shares one sync.
    fn commit(&mut self, waiting: Vec<Waiting>) {
        let mut group = Vec::new();
        for Waiting { submission, answer } in waiting {
            match submission {
                Submission::Prepared(prepared) => {
                    let Prepared { mut change, mut record, if_empty, carved_at, turn, reservation } =
                        *prepared;
                    if if_empty {
                        self.commit_group(&mut group);
                        if !self.map.is_empty() {
                            drop(answer.send(Err(Refusal::Stale)));
                            continue;
                        }
                    }
                    if let Err(error) = self.cut_carving(&mut change, &mut record, carved_at, &group) {
                        drop(answer.send(Err(Refusal::Failed(error))));
                        continue;
                    }
                    let (_turn, _memory) = (Some(turn), vec![reservation]);
                    group.push(Pending { change, record, answer, _turn, _memory, _pin: None });
                }
                Submission::Undecided(decide) => {
                    self.commit_group(&mut group);
                    self.decide(decide, answer, &mut group);
                    self.commit_group(&mut group);
                }
            }
        }
        self.commit_group(&mut group);
    }

    /// Cuts what a scan carves to what is there when its turn comes, and what no change since `carved_at` touched: another
    /// scan that saw something there meanwhile is not contradicted. Of changes that are no longer kept nobody knows what they
    /// touched: then the scan carves nothing.
    fn cut_carving(
        &self,
        change: &mut Change,
        record: &mut Option<Record>,
        carved_at: u64,
        group: &[Pending],
    ) -> Result<(), ServiceError> {
        let Change::Insertion(scan) = &mut *change else { return Ok(()) };
        if scan.carved.is_empty() {
            return Ok(());
        }
        let mut carving = Carving { voxels: std::mem::take(&mut scan.carved), revision: carved_at };
        let carved = carving.voxels.clone();
        for revision in carved_at + 1..=self.map.revision() {
            match self.told.recent.get(revision) {
                Some(change) => change.touched().into_iter().for_each(|touched| carving.cut(touched)),
                None => carving.voxels = VoxelSet::default(),
            }
            if carving.voxels.is_empty() {
                break;
            }
        }
        let before_it = group.iter().flat_map(|pending| pending.change.touched());
        before_it.for_each(|touched| carving.cut(touched));
        let is_cut = carving.voxels != carved;
        scan.carved = carving.voxels;
        if is_cut && record.is_some() {
            *record = Some(record_of(change)?);
        }
        Ok(())
    }

    fn decide(&self, decide: Decision, answer: oneshot::Sender<Outcome>, group: &mut Vec<Pending>) {
        let unchanged = Committed::none(self.map.content_version());
        let caller_gone = || answer.is_closed();
        let decided = || match decide(&self.map, StopSignal::when(&caller_gone))? {
            Some(Decided { change, record, lent, pin }) => {
                let record = match (record, &self.folder) {
                    (None, Some(_)) => Some(record_of(&change)?),
                    (record, _) => record,
                };
                Ok(Some((change, record, lent, pin)))
            }
            None => Ok(None),
        };
        match decided() {
            Ok(Some((change, record, _memory, _pin))) => {
                group.push(Pending { change, record, answer, _turn: None, _memory, _pin });
            }
            Ok(None) => drop(answer.send(Ok(unchanged))),
            Err(refusal) => drop(answer.send(Err(refusal))),
        }
    }

    /// Durable, then visible, then acknowledged.
    fn commit_group(&mut self, group: &mut Vec<Pending>) {
        let left = usize::try_from(REVISION_MAX.saturating_sub(self.map.revision())).unwrap_or(usize::MAX);
        for Pending { answer, .. } in group.drain(left.min(group.len())..) {
            drop(answer.send(Err(Refusal::Failed(revisions_used_up(&self.name)))));
        }
        if group.is_empty() {
            return;
        }
        let begin = Instant::now();
        if let Err(error) = self.journal(group) {
            for Pending { answer, .. } in group.drain(..) {
                drop(answer.send(Err(Refusal::Failed(error.clone()))));
            }
            return;
        }
        for Pending { change, answer, .. } in group.drain(..) {
            let Told { announced, recent } = &self.told;
            let (committed, levels) = self.map.committer().apply_noting(&change, recent.levels());
            debug_assert_ne!(committed.revision, *announced.borrow(), "every record makes a revision");
            announced.send_replace(committed.revision);
            drop(answer.send(Ok(committed)));
            recent.push(WatchedChange::of(committed.revision, Some(committed.hash), change, levels));
        }
        self.tell_durable();
        self.durations.record(begin.elapsed());
        self.thin_in_memory();
    }

    /// Tells who watches the map how far it is durable.
    fn tell_durable(&self) {
        let visible = self.map.revision();
        let durable = self.folder.as_ref().map_or(visible, |folder| folder.used().durable.min(visible));
        self.told.recent.tell_durable(durable);
    }

    /// Thins the trajectory of a map without a folder every now and then, as far behind the newest revision as undo would
    /// reach; that of others is thinned when undo reaches less far.
    fn thin_in_memory(&mut self) {
        let revision = self.map.revision();
        if self.folder.is_none() && revision - self.thinned >= THINNED_EVERY {
            let before = revision.saturating_sub(self.settings.undo_revisions);
            self.map.committer().thin(before, &self.settings.trajectory_spacing);
            self.thinned = revision;
        }
    }

    /// Appends a group and, where that is asked for, syncs it.
    fn journal(&mut self, group: &[Pending]) -> Result<(), ServiceError> {
        if let Some(stop) = self.stopped.get() {
            return Err(stop.refusal(&self.name));
        }
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        let records: Vec<&Record> = group.iter().filter_map(|pending| pending.record.as_ref()).collect();
        folder.append(&records).map_err(|error| match error {
            // Nothing was written.
            StoreError::JournalStopped(_) | StoreError::Gone | StoreError::RevisionsUsedUp(_) => {
                self.stop(&error)
            }
            error => self.lost_track(&error),
        })?;
        if folder.settings().durability == Durability::Always {
            folder.sync().map_err(|error| self.lost_track(&error))?;
        }
        self.unsynced.get_or_insert_with(Instant::now);
        Ok(())
    }

    /// Changes were handed to the journal, and nobody knows what became of them.
    fn lost_track(&self, error: &StoreError) -> ServiceError {
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
        let Durability::Interval(interval) = self.folder.as_ref()?.settings().durability else {
            return None;
        };
        Some(interval.saturating_sub(self.unsynced?.elapsed()))
    }

    fn sync_if_due(&mut self) {
        if self.until_sync().is_some_and(|rest| rest.is_zero()) {
            self.sync();
        }
    }

    fn sync(&mut self) {
        self.unsynced = None;
        if let (Some(folder), None) = (&self.folder, self.stopped.get())
            && let Err(error) = folder.sync()
        {
            self.stop(&error);
        }
        self.tell_durable();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.stopped.get_or_init(|| Stop::Failed("a defect of the server ended its thread".into()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::map::{DeletionRecord, MapSettings, MappedScan, RobotName, ScanRecord};
    use crate::service::recent_changes::RecentChanges;
    use crate::voxel::VoxelKey;

    fn voxels(x: std::ops::Range<i32>) -> VoxelSet {
        x.filter_map(|x| VoxelKey::new([x, 0, 0])).collect()
    }

    fn scan(seen: VoxelSet, carved: VoxelSet) -> Change {
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        Change::Insertion(ScanRecord { carved, ..ScanRecord::of_voxels(pose, seen) })
    }

    fn deletion(voxels: VoxelSet) -> Change {
        Change::Deletion(DeletionRecord { voxels, request: None })
    }

    /// A worker of a map to which these changes were made, and which remembers so many bytes of them.
    fn worker(changes: &[Change], recent_bytes: usize) -> Worker {
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(0.1, 2)).unwrap());
        let recent = Arc::new(RecentChanges::new(0, recent_bytes));
        for change in changes {
            let committed = map.committer().apply(change);
            recent.push(WatchedChange::of(committed.revision, None, change.clone(), Vec::new()));
        }
        let told = Told { announced: tokio::sync::watch::Sender::new(0), recent };
        let settings = StoreSettings::default();
        Worker::new(MapName::new("a").unwrap(), map, None, told, Arc::default(), Arc::default(), &settings)
    }

    /// What a scan carves that saw voxels 0 to 99 gone at revision 1, when its turn comes.
    fn cut(worker: &Worker, group: &[Change]) -> VoxelSet {
        let pending = |change: &Change| Pending {
            change: change.clone(),
            record: None,
            answer: oneshot::channel().0,
            _turn: None,
            _memory: Vec::new(),
            _pin: None,
        };
        let group: Vec<Pending> = group.iter().map(pending).collect();
        let mut change = scan(voxels(200..210), voxels(0..100));
        worker.cut_carving(&mut change, &mut None, 1, &group).unwrap();
        let Change::Insertion(scan) = change else { panic!("a scan is a scan") };
        scan.carved
    }

    #[test]
    fn what_went_or_was_seen_since_is_not_carved() {
        let first = scan(voxels(0..100), VoxelSet::default());
        let (gone, seen) = (deletion(voxels(0..10)), scan(voxels(90..120), voxels(80..90)));
        let nothing = [];
        assert_eq!(cut(&worker(std::slice::from_ref(&first), 1 << 20), &nothing), voxels(0..100));
        let all = [first.clone(), gone.clone(), seen.clone()];
        assert_eq!(cut(&worker(&all, 1 << 20), &nothing), voxels(10..80));
        assert_eq!(
            cut(&worker(&[first.clone(), gone], 1 << 20), std::slice::from_ref(&seen)),
            voxels(10..80)
        );
        assert_eq!(cut(&worker(&[first], 1 << 20), &[seen]), voxels(0..80));
    }

    #[test]
    fn where_nobody_knows_what_came_between_nothing_is_carved() {
        let first = scan(voxels(0..100), VoxelSet::default());
        assert_eq!(cut(&worker(std::slice::from_ref(&first), 0), &[]), voxels(0..100));
        assert!(cut(&worker(&[first, deletion(voxels(50..51))], 0), &[]).is_empty());
    }
}
