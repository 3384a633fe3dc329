//! How scans leave a map again.

use std::sync::Arc;

use super::committing::{Decided, Proposal, Refusal, Step, Stop};
use super::digest::{Digest, FormerDigest};
use super::hosted_map::HostedMap;
use super::room::Room;
use super::time_limit::TimeLimit;
use super::trajectory::check_not_forgotten;
use super::{ErrorCode, ServiceError, Undo, UndoAnswer, UndoTarget, check_not_stopped};
use crate::map::{
    CallerName, Change, Committed, MultiResolutionMap, Observations, Request, RequestKind, Trajectory,
    TrajectoryPose, UndoRecord, WithdrawnScan,
};
use crate::store::{MapFolder, StoreError};
use crate::util::StopSignal;
use crate::voxel::{Moments, VoxelKey};

impl HostedMap {
    /// Sets an undo on its way, unless it was done before.
    ///
    /// Who holds which voxels is read from the journal while scans go on coming in; the last of them are looked at when
    /// nobody else can change the map.
    pub(super) fn propose_undo(
        self: &Arc<Self>,
        undo: &Undo,
        caller: Option<&CallerName>,
        room: &Room,
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
            let (scans, removed, state) = (answered.scans, answered.voxels, self.state(answered.revision));
            return Ok(Step::Answered(UndoAnswer { scans, removed, state, replayed: true }));
        }
        room.check_to_shrink()?;
        let folder = self.folder.clone().ok_or_else(|| self.no_observations())?;
        let (scans, withdrawn) = self.targets_of_undo(&undo.target)?;
        if scans.is_empty() {
            let state = self.state(self.map.revision());
            return Ok(Step::Answered(UndoAnswer { scans: 0, removed: 0, state, replayed: false }));
        }
        // The map's content as it was before the first of them.
        let lent = room.lend(self.undo_bytes(), "an undo")?;
        let observed = folder.observations(&scans, &withdrawn, stop).map_err(|e| self.unreadable(&e))?;
        check_not_stopped(stop)?;
        let mut observed = observed.ok_or_else(|| self.out_of_reach(&folder, scans[0]))?;
        // What takes long is done here; what comes meanwhile is little, and changes the plan by as much.
        observed.observations.plan(stop);
        folder.observe(&mut observed, stop).map_err(|e| self.unreadable(&e))?;
        check_not_stopped(stop)?;

        let (map, count, limit) = (Arc::clone(self), scans.len(), limit.clone());
        let decide = move |core: &MultiResolutionMap, stop: StopSignal<'_>| {
            map.still_unanswered(RequestKind::Undo, request.as_ref(), former)?;
            if core.trajectory().withdrawn() != withdrawn {
                return Err(Refusal::Stale);
            }
            // What came meanwhile is shown while the map waits: that ends with the request's time as well.
            limit.run(stop, |stop| {
                folder.observe(&mut observed, stop).map_err(|e| map.unreadable(&e))?;
                check_not_stopped(stop)
            })?;
            let voxels = observed.observations.held_by_targets_alone();
            let moments = observed.observations.moments_without_targets();
            let change = Change::Undo(UndoRecord { scans, voxels, moments, request });
            Ok(Some(Decided { change, lent: Some(lent) }))
        };
        let outcome = self.committing.propose(Proposal::Undecided(Box::new(decide)))?;
        let map = Arc::clone(self);
        let answer = move |Committed { revision, voxels: removed }| UndoAnswer {
            scans: count,
            removed,
            state: map.state(revision),
            replayed: false,
        };
        Ok(Step::Proposed(outcome, Box::new(answer)))
    }

    /// Bytes of memory that an undo takes: the snapshot that it begins with, read and decoded, and who holds which voxels of
    /// it. A map that had more in it then than now takes more.
    fn undo_bytes(&self) -> u64 {
        let blocks = self.map.view().lists(0).map(|list| list.blocks().len()).sum();
        let moments = self.map.moments().bytes() / size_of::<(VoxelKey, Moments)>();
        self.snapshot_bytes() + Observations::bytes_max(blocks, moments) as u64
    }

    /// The revisions of the scans that are meant, ascending, and the scans that were withdrawn before.
    fn targets_of_undo(&self, target: &UndoTarget) -> Result<(Vec<u64>, Vec<WithdrawnScan>), ServiceError> {
        let trajectory = self.map.trajectory();
        let one = |found: Option<&TrajectoryPose>, what: String| {
            let missing = || {
                let message = format!("map {} has no accepted scan {what}", self.name);
                ServiceError::new(ErrorCode::NotFound, "scan_not_found", message)
            };
            found.map(|pose| vec![pose.revision]).ok_or_else(missing)
        };
        let scans = match target {
            UndoTarget::Scan { robot, scan_id } => {
                check_not_forgotten(&trajectory, robot, *scan_id)?;
                one(trajectory.find(robot, *scan_id), format!("of scan_id {scan_id} of robot {robot}"))?
            }
            UndoTarget::Revision(revision) => {
                self.check_reach(&trajectory, *revision)?;
                one(trajectory.at(*revision), format!("that made revision {revision}"))?
            }
            UndoTarget::RobotSince { robot, revision } => {
                trajectory.poses_after(*revision, Some(robot)).map(|pose| pose.revision).collect()
            }
        };
        Ok((scans, trajectory.withdrawn().to_vec()))
    }

    /// Refuses a scan that may be out of reach and is not kept.
    fn check_reach(&self, trajectory: &Trajectory, revision: u64) -> Result<(), ServiceError> {
        let folder = self.folder.as_ref().filter(|_| trajectory.at(revision).is_none());
        let out_of_reach = folder.filter(|folder| revision < folder.used().undo_from);
        out_of_reach.map_or(Ok(()), |folder| Err(self.out_of_reach(folder, revision)))
    }

    /// The journal cannot be read; that of a map that was deleted meanwhile need not be.
    fn unreadable(&self, error: &StoreError) -> ServiceError {
        match self.folder.as_deref().is_some_and(MapFolder::is_gone) {
            true => Stop::Deleted.refusal(&self.name),
            false => ServiceError::new(ErrorCode::Internal, "journal_unreadable", error.to_string()),
        }
    }

    fn no_observations(&self) -> ServiceError {
        let message =
            format!("map {} is kept in memory only: undo needs the journal of a data folder", self.name);
        ServiceError::new(ErrorCode::FailedPrecondition, "no_journal", message)
    }

    fn out_of_reach(&self, folder: &MapFolder, first: u64) -> ServiceError {
        let message = format!(
            "undo reaches back to revision {} of map {}, and the first of the scans made revision {first}; \
             store.undo_revisions is {}, store.undo_bytes_max {}",
            folder.used().undo_from,
            self.name,
            folder.settings().undo_revisions,
            folder.settings().undo_bytes_max
        );
        ServiceError::new(ErrorCode::FailedPrecondition, "undo_out_of_reach", message)
    }
}

/// Tells one request from another under the same id.
fn digest(target: &UndoTarget) -> u64 {
    let digest = Digest::new("undo");
    match target {
        UndoTarget::Scan { robot, scan_id } => {
            digest.bytes(b"scan").bytes(robot.as_str().as_bytes()).number(*scan_id)
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
        UndoTarget::Scan { robot, scan_id } => digest.bytes(robot.as_str().as_bytes()).number(*scan_id),
        UndoTarget::Revision(revision) => digest.number(*revision),
        UndoTarget::RobotSince { robot, revision } => {
            digest.bytes(b"since").bytes(robot.as_str().as_bytes()).number(*revision)
        }
    }
    .finish()
}
