//! The poses of accepted scans: given out in pages and pieces, thinned where undo reaches them no more.

use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;

use super::hosted_map::HostedMap;
use super::{ErrorCode, Limits, MapService, MapState, ServiceError, TrajectoryAnswer, TrajectoryQuery};
use crate::map::{MapName, MultiResolutionMap, RobotName, Trajectory};
use crate::store::MapFolder;

/// Poses of one piece of a streamed trajectory.
const POSES_PER_PIECE: usize = 512;

impl MapService {
    /// The poses of the accepted scans, of one robot or of all, in the order of acceptance: a page of them.
    ///
    /// # Errors
    /// `NotFound` without such a map; `InvalidArgument` for a page of no pose, or of more than `trajectory_page_max`;
    /// `ResourceExhausted` when too many jobs wait.
    pub async fn trajectory(
        &self,
        map: &MapName,
        query: TrajectoryQuery,
    ) -> Result<TrajectoryAnswer, ServiceError> {
        let (map, most) = (self.map(map)?, self.limits().page(query.limit)?);
        self.inner.queries.run(move |_| map.trajectory(&query, most, u64::MAX)).await
    }

    /// The same in pieces, as many as it takes. Without a limit, all poses since the revision that is asked for.
    ///
    /// # Errors
    /// As for a page.
    pub async fn trajectory_pieces(
        &self,
        map: &MapName,
        query: TrajectoryQuery,
    ) -> Result<TrajectoryPieces, ServiceError> {
        let page = query.limit.map(|limit| self.limits().page(Some(limit))).transpose()?;
        let hosted = self.map(map)?;
        let (until, state) = (hosted.map.revision(), hosted.state(hosted.map.revision()));
        let (service, map) = (self.clone(), map.clone());
        Ok(TrajectoryPieces { service, map, query, left: page, until, state, ended: false })
    }
}

/// The pieces of a trajectory: each is made when it is asked for, at a revision of its own, of scans up to the revision
/// at which the first was asked for. Nothing is held between two pieces.
#[derive(Debug)]
pub struct TrajectoryPieces {
    service: MapService,
    map: MapName,
    /// What is still to come.
    query: TrajectoryQuery,
    /// Poses that may still come, where that is bounded.
    left: Option<usize>,
    until: u64,
    state: MapState,
    ended: bool,
}

impl TrajectoryPieces {
    /// Bytes of memory that pieces take until they are sent, at most: one that is made, one that waits, one that is
    /// sent; a pose takes less than a KiB in any form.
    pub const BYTES: usize = 3 * POSES_PER_PIECE * 1024;

    /// The state up to which poses come.
    pub fn state(&self) -> MapState {
        self.state
    }

    /// The next piece; none after the last. The first is there even where it has no pose. Only in the last one does
    /// `next_since_revision` say that there is more than was asked for.
    ///
    /// # Errors
    /// `NotFound` or `FailedPrecondition` where the map is gone meanwhile, or another has its name; `ResourceExhausted`
    /// when too many jobs wait. After an error comes no other piece.
    pub async fn next(&mut self) -> Option<Result<TrajectoryAnswer, ServiceError>> {
        if self.ended {
            return None;
        }
        let piece = self.piece().await;
        self.ended = !piece.as_ref().is_ok_and(|(_, goes_on)| *goes_on);
        Some(piece.map(|(piece, _)| piece))
    }

    /// The pieces as a stream, which makes one ahead of the one that is sent.
    pub fn into_stream(mut self) -> impl Stream<Item = Result<TrajectoryAnswer, ServiceError>> + Send {
        let (outbox, pieces) = tokio::sync::mpsc::channel(1);
        tokio::spawn(async move {
            while let Some(piece) = self.next().await {
                if outbox.send(piece).await.is_err() {
                    break;
                }
            }
        });
        ReceiverStream::new(pieces)
    }

    /// The next piece, and whether another one follows.
    async fn piece(&mut self) -> Result<(TrajectoryAnswer, bool), ServiceError> {
        let map = self.service.map(&self.map)?;
        map.check_uuid(Some(self.state.map_uuid))?;
        let most = self.left.map_or(POSES_PER_PIECE, |left| left.min(POSES_PER_PIECE));
        let (query, until) = (self.query.clone(), self.until);
        let job = move |_: crate::util::StopSignal<'_>| map.trajectory(&query, most, until);
        let mut piece = self.service.inner.queries.run(job).await?;
        self.left = self.left.map(|left| left - piece.poses.len());
        let goes_on = piece.next_since_revision.is_some() && self.left != Some(0);
        if goes_on {
            self.query.since_revision = piece.next_since_revision.take().unwrap_or(self.query.since_revision);
        }
        Ok((piece, goes_on))
    }
}

impl HostedMap {
    /// At most `most` poses of scans that made a revision up to `until`.
    fn trajectory(&self, query: &TrajectoryQuery, most: usize, until: u64) -> TrajectoryAnswer {
        let (trajectory, revision) = self.map.trajectory_and_revision();
        let wanted = trajectory.poses_after(query.since_revision, query.robot.as_ref());
        let mut wanted = wanted.take_while(|pose| pose.revision <= until);
        let poses: Vec<_> = wanted.by_ref().take(most).cloned().collect();
        let last = poses.last().map(|pose| pose.revision);
        let next_since_revision = last.filter(|_| wanted.next().is_some());
        TrajectoryAnswer { poses, next_since_revision, state: self.state(revision) }
    }

    /// Refuses a robot that the map does not know where it knows as many as it may.
    pub(super) fn check_robots(&self, robot: &RobotName, limits: &Limits) -> Result<(), ServiceError> {
        let (trajectory, most) = (self.map.trajectory(), limits.robots_per_map_max);
        if trajectory.knows(robot) || trajectory.robots_known() < most {
            return Ok(());
        }
        let message = format!(
            "map {} has scans of {} robots, robots_per_map_max is {most}: robot {robot} is one more; use one of their \
             names, or raise the limit",
            self.name,
            trajectory.robots_known()
        );
        Err(ServiceError::new(ErrorCode::ResourceExhausted, "too_many_robots", message))
    }
}

/// Thins the poses of `map` that undo reaches no more. Waits for the turn to change the map.
pub(super) fn thin(map: &MultiResolutionMap, folder: &MapFolder) {
    let before = folder.used().undo_from;
    map.committer().thin(before, &folder.settings().trajectory_spacing);
}

/// # Errors
/// For a scan that was accepted so long ago that nothing is kept of it but its id, or may have been.
pub(super) fn check_not_forgotten(
    trajectory: &Trajectory,
    robot: &RobotName,
    scan_id: u64,
) -> Result<(), ServiceError> {
    if !trajectory.has_forgotten(robot, scan_id) {
        return Ok(());
    }
    let message = format!(
        "scan_id {scan_id} of robot {robot} is too old: a scan of that id was accepted, or may have been, before what \
         undo reaches, and its answer is not kept; number new scans upwards"
    );
    Err(ServiceError::new(ErrorCode::FailedPrecondition, "scan_id_too_old", message))
}
