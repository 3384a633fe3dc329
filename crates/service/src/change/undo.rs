//! How scans and deletions are taken back.

use std::sync::Arc;

use tokio::sync::OwnedMutexGuard;

use super::digest::{Digest, FormerDigest};
use super::robot_known::listed_sessions;
use crate::commit::{Decided, Refusal, Step, Submission, record_of};
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::{self, Outcome};
use crate::request::{Undo, UndoAnswer, UndoTarget, scan_id_too_old, scan_name};
use crate::resources::{Reservation, ResourceBudget, growth_bytes, removal_bytes};
use crate::work::{Requester, TimeLimit, check_not_stopped, ended_early};
use mrol_map::map::{
    CallerName, Change, Committed, CompletedRequest, KnownScan, MapName, MultiResolutionMap, Request,
    RequestKind, Reversal, UndoRecord, WithdrawnChange,
};
use mrol_map::util::StopSignal;
use mrol_store::{MapFolder, NotObserved, Observed, Record};

/// Name under which the memory is reserved, for refusals.
const UNDO: &str = "an undo";

/// An undo as it would be had nothing changed since.
struct PlannedUndo {
    change: Change,
    record: Record,
    observed: Observed,
    reserved: Vec<Reservation>,
}

impl PlannedUndo {
    /// The undo as it is now, while nobody else can change the map: what came since is little, and changes it by as
    /// much.
    fn decided(
        self,
        map: &HostedMap,
        folder: &MapFolder,
        stop: StopSignal<'_>,
    ) -> Result<Decided, ServiceError> {
        let Self { mut change, record, mut observed, reserved } = self;
        folder.observe(&mut observed, stop).map_err(|e| map.unreadable(&e))?;
        check_not_stopped(stop)?;
        let Observed { observations, pin, .. } = observed;
        let is_other = match &mut change {
            Change::Undo(undo) => {
                observations.renew(&mut undo.removed, &mut undo.restored, &mut undo.moments)
            }
            Change::Insertion(_) | Change::Deletion(_) | Change::KeepOut(_) => false,
        };
        Ok(Decided { change, record: Some(record).filter(|_| !is_other), reserved, pin: Some(pin) })
    }
}

impl MapService {
    /// Takes scans or a deletion back: the map is then what all other changes make of it, with the deletions as they
    /// were. Of the voxels that a scan touched, those that no other scan holds go; those that a deletion took out come
    /// back.
    ///
    /// # Errors
    /// `NotFound` without such a map, robot, scan or revision; `FailedPrecondition` for a change from before what undo
    /// reaches, for a revision that an undo made, or where maps are kept in memory only; `ResourceExhausted` while the
    /// disk is nearly full, where there is no memory to find out in what the map would be, or none for what comes back;
    /// `DeadlineExceeded` with `time_limit` beyond `undo_time_max`.
    pub async fn undo(&self, map: &MapName, undo: Undo) -> Result<UndoAnswer, ServiceError> {
        let work = async {
            self.scans.permit_undo(&undo.target)?;
            let (map, undo) = (self.map(map).await?, Arc::new(undo));
            self.at_the_leader(
                &map,
                || self.undo_here(&map, &undo),
                |leader, call| {
                    let undo = Undo::clone(&undo);
                    async move { leader.undo(&call, undo).await }
                },
            )
            .await
        };
        self.observed("Undo", Some(map), work, |answer| Outcome::Changed(observer::Change::of_undo(answer)))
            .await
    }

    async fn undo_here(&self, map: &Arc<HostedMap>, undo: &Arc<Undo>) -> Result<UndoAnswer, ServiceError> {
        let limit = TimeLimit::new("undo_time_max", self.limits().undo_time_max_s);
        // Until its outcome is known: what was withdrawn before it is then what it found.
        let (lane, requester) = (&self.inner.lanes.undo, Requester::from(&self.asker));
        let _undo = lane.once_free(&self.asker, map.lock_undo()).await?;
        // A thread first: the robot's scans wait for this undo, and not for those of other maps.
        let thread = lane.thread(&requester).await?;
        let _robot = map.lock_robot_of(&undo.target).await;
        let (of, undo) = (Arc::clone(map), Arc::clone(undo));
        let (inner, caller) = (Arc::clone(&self.inner), self.caller.clone());
        let names_robots = self.scans.may_know_all_robots();
        self.submit_and_wait(("Undo", map), (lane, &requester), Some(thread), move |stop| {
            limit.run(stop, |stop| {
                of.prepare_undo(&undo, caller.as_ref(), names_robots, &inner.budget, &limit, stop)
            })
        })
        .await
    }
}

impl HostedMap {
    /// Waits until the undos before are done.
    pub(super) async fn lock_undo(&self) -> OwnedMutexGuard<()> {
        Arc::clone(&self.undo_lock).lock_owned().await
    }

    /// Waits, before an undo of all scans of a robot, until its earlier scans are done: those that come later wait in
    /// turn, so that none that the undo does not know of lies before it.
    pub(super) async fn lock_robot_of(&self, target: &UndoTarget) -> Option<OwnedMutexGuard<()>> {
        match target {
            UndoTarget::RobotSince { robot, .. } => Some(self.robots.lock_robot(robot).await),
            UndoTarget::Scan { .. } | UndoTarget::Revision(_) => None,
        }
    }

    /// Prepares an undo, unless it was done before.
    ///
    /// The owners of the voxels are read from the journal while scans go on coming in; the last of them are looked at
    /// when nobody else can change the map. An error for a robot that the map does not know names those that it knows
    /// if `names_robots`.
    pub(crate) fn prepare_undo(
        self: &Arc<Self>,
        undo: &Undo,
        caller: Option<&CallerName>,
        names_robots: bool,
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
        let answered = self.answered(RequestKind::Undo, request.as_ref(), former)?;
        if let Some(answered) = answered {
            let CompletedRequest { scans, deletions, removed, restored, revision, .. } = answered;
            let version = self.version_at(revision);
            let answer = UndoAnswer { scans, deletions, removed, restored, version, replayed: true };
            return Ok(Step::Answered(answer));
        }
        self.check_robot_known(&undo.target, names_robots)?;
        budget.check_to_shrink()?;
        let folder = self.folder.clone().ok_or_else(|| self.no_journal(UNDO))?;
        let withdrawn = self.map.trajectory().withdrawn().to_vec();
        let targets = self.targets_of_undo(&undo.target, &folder, &withdrawn)?;
        let (scans, deletions) = (targets.scans.len(), targets.deletions.len());
        if targets.changes().next().is_none() {
            let (version, replayed) = (self.version_now(), false);
            let answer = UndoAnswer { scans, deletions, removed: 0, restored: 0, version, replayed };
            return Ok(Step::Answered(answer));
        }
        let targets = UndoRecord { request: request.clone(), ..targets };
        let planned = self.plan_undo(&folder, targets, &withdrawn, budget, stop)?;
        let (map, limit) = (Arc::clone(self), limit.clone());
        let decide = move |core: &MultiResolutionMap, stop: StopSignal<'_>| {
            map.still_unanswered(RequestKind::Undo, request.as_ref(), former)?;
            if core.trajectory().withdrawn() != withdrawn {
                return Err(Refusal::Stale);
            }
            // What came meanwhile is shown while the map waits: that ends with the request's time as well.
            Ok(Some(limit.run(stop, |stop| planned.decided(&map, &folder, stop))?))
        };
        let map = Arc::clone(self);
        let answer = move |committed: Committed| UndoAnswer {
            scans,
            deletions,
            removed: committed.removed,
            restored: committed.added,
            version: map.version(committed.version()),
            replayed: false,
        };
        Ok(Step::Ready(Submission::Undecided(Box::new(decide)), Box::new(answer)))
    }

    /// What undoing `targets` does, as the map is now: what takes long is done here, on a thread of its own.
    fn plan_undo(
        &self,
        folder: &MapFolder,
        mut targets: UndoRecord,
        withdrawn: &[WithdrawnChange],
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<PlannedUndo, ServiceError> {
        let changes: Vec<u64> = targets.changes().collect();
        let mut observed = self.observe(folder, &changes, withdrawn, budget, stop)?;
        let finding_out = budget.reserve_transient(observed.observations.reversal_bytes() as u64, UNDO)?;
        let reversal = observed.observations.reversal(stop).ok_or_else(|| ended_early(stop))?;
        let Reversal { mut removed, mut restored, mut moments } = reversal;
        folder.observe(&mut observed, stop).map_err(|e| self.unreadable(&e))?;
        check_not_stopped(stop)?;
        observed.observations.renew(&mut removed, &mut restored, &mut moments);
        let removal = budget.reserve_transient(removal_bytes(&self.map, &removed), UNDO)?;
        let mut reserved = vec![finding_out, removal];
        if !restored.is_empty() {
            let growth = growth_bytes(self.map.settings(), &restored, moments.as_slice().len());
            reserved.push(budget.reserve_growth(growth)?);
        }
        (targets.removed, targets.restored, targets.moments) = (removed, restored, moments);
        let change = Change::Undo(targets);
        let record = record_of(&change)?;
        Ok(PlannedUndo { change, record, observed, reserved })
    }

    /// What the map holds without `changes`. Memory is reserved for each part before it is built.
    fn observe(
        &self,
        folder: &MapFolder,
        changes: &[u64],
        withdrawn: &[WithdrawnChange],
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Observed, ServiceError> {
        // What was reserved before lies in memory by the time more is asked for, and is measured there.
        let mut part = None;
        let reserve = |bytes| {
            drop(part.take());
            part = Some(budget.reserve_transient(bytes, UNDO)?);
            Ok(())
        };
        let settings = self.map.settings();
        folder.observations(settings, changes, withdrawn, reserve, stop).map_err(|why| match why {
            NotObserved::OutsideUndoWindow => self.outside_undo_window(folder, changes[0], withdrawn),
            NotObserved::Stopped => ended_early(stop),
            NotObserved::NoMemory(refusal) => refusal,
            NotObserved::Unreadable(error) => self.unreadable(&error),
        })
    }

    /// The changes that are meant, of which those of `withdrawn` were taken back before.
    fn targets_of_undo(
        &self,
        target: &UndoTarget,
        folder: &MapFolder,
        withdrawn: &[WithdrawnChange],
    ) -> Result<UndoRecord, ServiceError> {
        let trajectory = self.map.trajectory();
        let scans = match target {
            UndoTarget::Scan { robot, session, scan_id } => {
                match trajectory.known(robot, session, *scan_id) {
                    Some(KnownScan::Kept(pose)) => vec![pose.revision],
                    Some(KnownScan::TooOld) => return Err(scan_id_too_old(robot, session, *scan_id)),
                    Some(KnownScan::Undone(_)) | None => {
                        let others = listed_sessions(&trajectory.sessions_with(robot, *scan_id));
                        let what = format!("of {}{others}", scan_name(robot, session, *scan_id));
                        return Err(self.no_scan(&what));
                    }
                }
            }
            UndoTarget::Revision(revision) => match trajectory.at(*revision) {
                Some(pose) => vec![pose.revision],
                None if trajectory.is_undone(*revision) => {
                    let what = format!("that made revision {revision}: it was undone already");
                    return Err(self.no_scan(&what));
                }
                None => return self.deletion_to_undo(*revision, folder, withdrawn),
            },
            UndoTarget::RobotSince { robot, revision } => {
                trajectory.poses_after(*revision, Some(robot)).map(|pose| pose.revision).collect()
            }
        };
        Ok(UndoRecord { scans, ..UndoRecord::default() })
    }

    /// The deletion that made `revision`, which no accepted scan made.
    fn deletion_to_undo(
        &self,
        revision: u64,
        folder: &MapFolder,
        withdrawn: &[WithdrawnChange],
    ) -> Result<UndoRecord, ServiceError> {
        let what = || format!("that made revision {revision}, and no deletion that did");
        if revision > self.map.revision() {
            return Err(self.no_scan(&what()));
        }
        let not_undoable = |why: String| {
            let message = format!("revision {revision} of map {} {why}", self.name);
            Err(ServiceError::new(Reason::NotUndoable, message))
        };
        if let Some(undone) = withdrawn.iter().find(|withdrawn| withdrawn.change == revision) {
            return not_undoable(format!("was undone already, by revision {}", undone.revision));
        }
        match folder.change_at::<ServiceError>(revision, withdrawn) {
            Ok(Some(Change::Deletion(_))) => {
                Ok(UndoRecord { deletions: vec![revision], ..UndoRecord::default() })
            }
            Ok(Some(Change::Undo(_))) => not_undoable("was made by an undo, which is not undone".to_owned()),
            Ok(Some(Change::KeepOut(_))) => not_undoable(
                "put or ended a keep-out, which is not undone: put or delete it again".to_owned(),
            ),
            Ok(Some(Change::Insertion(_)) | None) => Err(self.no_scan(&what())),
            Err(NotObserved::Unreadable(error)) => Err(self.unreadable(&error)),
            Err(_) => Err(self.outside_undo_window(folder, revision, withdrawn)),
        }
    }

    fn no_scan(&self, what: &str) -> ServiceError {
        let message = format!("map {} has no accepted scan {what}", self.name);
        ServiceError::new(Reason::ScanNotFound, message)
    }

    fn outside_undo_window(
        &self,
        folder: &MapFolder,
        first: u64,
        withdrawn: &[WithdrawnChange],
    ) -> ServiceError {
        let message = format!(
            "undo reaches back to revision {} of map {}, and the first of the changes made revision {first}: it takes a \
             snapshot from before it, without changes that were undone later, and the journal from there on, which are kept \
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
