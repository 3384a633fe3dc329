//! How scans leave a map again.

use std::sync::Arc;

use tokio::sync::OwnedMutexGuard;

use super::commit_queue::{Decided, Refusal, Step, Stop, Submission, record_of};
use super::deletion::removal_bytes;
use super::digest::{Digest, FormerDigest};
use super::hosted_map::HostedMap;
use super::resource_budget::{Reservation, ResourceBudget};
use super::time_limit::TimeLimit;
use super::trajectory::{scan_id_too_old, scan_name};
use super::{Reason, ServiceError, Undo, UndoAnswer, UndoTarget, check_not_stopped, ended_early};
use crate::map::{
    CallerName, Change, Committed, KnownScan, Leaving, MappedScan, MultiResolutionMap, Request, RequestKind,
    Trajectory, UndoRecord, WithdrawnScan,
};
use crate::store::{MapFolder, NotObserved, Observed, Record, StoreError};
use crate::util::StopSignal;

/// Whom memory is lent to, in refusals.
const UNDO: &str = "an undo";

/// An undo as it would be had nothing changed since.
struct PlannedUndo {
    change: Change,
    record: Record,
    observed: Observed,
    lent: Vec<Reservation>,
}

impl PlannedUndo {
    /// The undo as it is now, while nobody else can change the map: what came since is little, and changes it by as much.
    fn decided(
        self,
        map: &HostedMap,
        folder: &MapFolder,
        stop: StopSignal<'_>,
    ) -> Result<Decided, ServiceError> {
        let Self { mut change, record, mut observed, lent } = self;
        folder.observe(&mut observed, stop).map_err(|e| map.unreadable(&e))?;
        check_not_stopped(stop)?;
        let Observed { observations, pin, .. } = observed;
        let is_other = match &mut change {
            Change::Undo(undo) => observations.renew(&mut undo.voxels, &mut undo.moments),
            Change::Insertion(_) | Change::Deletion(_) => false,
        };
        Ok(Decided { change, record: Some(record).filter(|_| !is_other), lent, pin: Some(pin) })
    }
}

impl HostedMap {
    /// Waits until the undos before are done.
    pub(super) async fn turn_of_undo(&self) -> OwnedMutexGuard<()> {
        Arc::clone(&self.undo_turn).lock_owned().await
    }

    /// Waits, before an undo of all scans of a robot, until its earlier scans are done: those that come later wait in turn,
    /// so that none that the undo does not know of lies before it.
    pub(super) async fn turn_of_target(&self, target: &UndoTarget) -> Option<OwnedMutexGuard<()>> {
        match target {
            UndoTarget::RobotSince { robot, .. } => Some(self.lock_robot(robot).await),
            UndoTarget::Scan { .. } | UndoTarget::Revision(_) => None,
        }
    }

    /// Sets an undo on its way, unless it was done before.
    ///
    /// Who holds which voxels is read from the journal while scans go on coming in; the last of them are looked at when
    /// nobody else can change the map.
    pub(super) fn submit_undo(
        self: &Arc<Self>,
        undo: &Undo,
        caller: Option<&CallerName>,
        budget: &ResourceBudget,
        limit: &TimeLimit,
        stop: StopSignal<'_>,
    ) -> Result<Step<UndoAnswer>, ServiceError> {
        self.check_writable()?;
        let request = undo.request_id.clone().map(|id| Request {
            id,
            digest: digest(&undo.target),
            caller: caller.cloned(),
        });
        let former = former_digest(&undo.target);
        if let Some(answered) = self.answered(RequestKind::Undo, request.as_ref(), former)? {
            let (scans, removed, version) =
                (answered.scans, answered.voxels, self.version_at(answered.revision));
            return Ok(Step::Answered(UndoAnswer { scans, removed, version, replayed: true }));
        }
        budget.check_to_shrink()?;
        let folder = self.folder.clone().ok_or_else(|| self.no_observations())?;
        let (scans, withdrawn) = self.targets_of_undo(&undo.target)?;
        if scans.is_empty() {
            let version = self.version_now();
            return Ok(Step::Answered(UndoAnswer { scans: 0, removed: 0, version, replayed: false }));
        }
        let count = scans.len();
        let planned = self.plan_undo(&folder, scans, &withdrawn, request.clone(), budget, stop)?;
        let (map, limit) = (Arc::clone(self), limit.clone());
        let decide = move |core: &MultiResolutionMap, stop: StopSignal<'_>| {
            map.still_unanswered(RequestKind::Undo, request.as_ref(), former)?;
            if core.trajectory().withdrawn() != withdrawn {
                return Err(Refusal::Stale);
            }
            // What came meanwhile is shown while the map waits: that ends with the request's time as well.
            Ok(Some(limit.run(stop, |stop| planned.decided(&map, &folder, stop))?))
        };
        let outcome = self.commit_queue.submit(Submission::Undecided(Box::new(decide)))?;
        let map = Arc::clone(self);
        let answer = move |committed: Committed| UndoAnswer {
            scans: count,
            removed: committed.voxels,
            version: map.version(committed.version()),
            replayed: false,
        };
        Ok(Step::Submitted(outcome, Box::new(answer)))
    }

    /// What leaves with `scans`, as the map is now: what takes long is done here, on a thread of its own.
    fn plan_undo(
        &self,
        folder: &MapFolder,
        scans: Vec<u64>,
        withdrawn: &[WithdrawnScan],
        request: Option<Request>,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<PlannedUndo, ServiceError> {
        let mut observed = self.observe(folder, &scans, withdrawn, budget, stop)?;
        let finding_out = budget.reserve_transient(observed.observations.leaving_bytes() as u64, UNDO)?;
        let leaving = observed.observations.leaving(stop).ok_or_else(|| ended_early(stop))?;
        let Leaving { mut voxels, mut moments } = leaving;
        folder.observe(&mut observed, stop).map_err(|e| self.unreadable(&e))?;
        check_not_stopped(stop)?;
        observed.observations.renew(&mut voxels, &mut moments);
        let removal = budget.reserve_transient(removal_bytes(&self.map, &voxels), UNDO)?;
        let change = Change::Undo(UndoRecord { scans, voxels, moments, request });
        let record = record_of(&change)?;
        Ok(PlannedUndo { change, record, observed, lent: vec![finding_out, removal] })
    }

    /// Who holds which of the voxels that `scans` touched. Memory is lent for each part before it is built.
    fn observe(
        &self,
        folder: &MapFolder,
        scans: &[u64],
        withdrawn: &[WithdrawnScan],
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Observed, ServiceError> {
        // What was lent before lies in memory by the time more is asked for, and is measured there.
        let mut part = None;
        let reserve = |bytes| {
            drop(part.take());
            part = Some(budget.reserve_transient(bytes, UNDO)?);
            Ok(())
        };
        folder.observations(scans, withdrawn, reserve, stop).map_err(|why| match why {
            NotObserved::OutsideUndoWindow => self.outside_undo_window(folder, scans[0], withdrawn),
            NotObserved::Stopped => ended_early(stop),
            NotObserved::NoMemory(refusal) => refusal,
            NotObserved::Unreadable(error) => self.unreadable(&error),
        })
    }

    /// The revisions of the scans that are meant, ascending, and the scans that were withdrawn before.
    fn targets_of_undo(&self, target: &UndoTarget) -> Result<(Vec<u64>, Vec<WithdrawnScan>), ServiceError> {
        let trajectory = self.map.trajectory();
        let one = |found: Option<&MappedScan>, what: String| {
            let missing = || {
                let message = format!("map {} has no accepted scan {what}", self.name);
                ServiceError::new(Reason::ScanNotFound, message)
            };
            found.map(|pose| vec![pose.revision]).ok_or_else(missing)
        };
        let scans = match target {
            UndoTarget::Scan { robot, session, scan_id } => {
                let found = match trajectory.known(robot, session, *scan_id) {
                    Some(KnownScan::Kept(pose)) => Some(pose),
                    Some(KnownScan::TooOld) => return Err(scan_id_too_old(robot, session, *scan_id)),
                    Some(KnownScan::Undone(_)) | None => None,
                };
                one(found, format!("of {}", scan_name(robot, session, *scan_id)))?
            }
            UndoTarget::Revision(revision) => {
                self.check_undo_window(&trajectory, *revision)?;
                one(trajectory.at(*revision), format!("that made revision {revision}"))?
            }
            UndoTarget::RobotSince { robot, revision } => {
                trajectory.poses_after(*revision, Some(robot)).map(|pose| pose.revision).collect()
            }
        };
        Ok((scans, trajectory.withdrawn().to_vec()))
    }

    /// Refuses a scan that may be outside the undo window and is not kept.
    fn check_undo_window(&self, trajectory: &Trajectory, revision: u64) -> Result<(), ServiceError> {
        let folder = self.folder.as_ref().filter(|_| trajectory.at(revision).is_none());
        let outside_undo_window = folder.filter(|folder| revision < folder.undo_from(trajectory.withdrawn()));
        outside_undo_window
            .map_or(Ok(()), |folder| Err(self.outside_undo_window(folder, revision, trajectory.withdrawn())))
    }

    /// The journal cannot be read; that of a map that was deleted meanwhile need not be.
    fn unreadable(&self, error: &StoreError) -> ServiceError {
        match self.folder.as_deref().is_some_and(MapFolder::is_gone) {
            true => Stop::Deleted.refusal(&self.name),
            false => ServiceError::new(Reason::JournalUnreadable, error.to_string()),
        }
    }

    fn no_observations(&self) -> ServiceError {
        let message =
            format!("map {} is kept in memory only: undo needs the journal of a data folder", self.name);
        ServiceError::new(Reason::NoJournal, message)
    }

    fn outside_undo_window(
        &self,
        folder: &MapFolder,
        first: u64,
        withdrawn: &[WithdrawnScan],
    ) -> ServiceError {
        let message = format!(
            "undo reaches back to revision {} of map {}, and the first of the scans made revision {first}: it takes a \
             snapshot from before it, without scans that were undone later, and the journal from there on, which are kept \
             within store.undo_revisions, {}, and store.undo_bytes_max, {}, and not where the map was restored since",
            folder.undo_from(withdrawn),
            self.name,
            folder.settings().undo_revisions,
            folder.settings().undo_bytes_max
        );
        ServiceError::new(Reason::OutsideUndoWindow, message)
    }
}

/// Tells one request from another under the same id.
fn digest(target: &UndoTarget) -> u64 {
    let digest = Digest::new("undo");
    match target {
        UndoTarget::Scan { robot, session, scan_id } => {
            let digest = digest.bytes(b"scan").bytes(robot.as_str().as_bytes()).number(*scan_id);
            // Requests from before there were sessions have the digest without one.
            if session.is_empty() { digest } else { digest.bytes(session.as_str().as_bytes()) }
        }
        UndoTarget::Revision(revision) => digest.bytes(b"revision").number(*revision),
        UndoTarget::RobotSince { robot, revision } => {
            digest.bytes(b"since").bytes(robot.as_str().as_bytes()).number(*revision)
        }
    }
    .finish()
}

/// The digest of the same request in data folders of version 3 and before.
fn former_digest(target: &UndoTarget) -> u64 {
    let digest = FormerDigest::default().bytes(b"undo");
    match target {
        UndoTarget::Scan { robot, scan_id, .. } => digest.bytes(robot.as_str().as_bytes()).number(*scan_id),
        UndoTarget::Revision(revision) => digest.number(*revision),
        UndoTarget::RobotSince { robot, revision } => {
            digest.bytes(b"since").bytes(robot.as_str().as_bytes()).number(*revision)
        }
    }
    .finish()
}
