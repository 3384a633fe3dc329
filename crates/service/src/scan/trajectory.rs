//! The poses of accepted scans: given out in pages and pieces, thinned where undo reaches them no more.

use std::sync::Arc;

use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;

use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{MapVersion, TrajectoryAnswer, TrajectoryQuery};
use crate::work::Asker;
use mrol_map::map::{MapName, RobotName, Trajectory};
use mrol_map::util::StopSignal;

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
        let work = async {
            let (map, most) = (self.map(map).await?, self.limits().page(query.limit)?);
            let page_of = move |_: StopSignal<'_>| {
                let (trajectory, version) = map.map.trajectory_and_version();
                page(&trajectory, map.version(version), &query, most)
            };
            self.inner.lanes.queries.run(&self.asker, page_of).await
        };
        self.observed("GetTrajectory", Some(map), work, |_| Outcome::Read).await
    }

    /// [`MapService::trajectory`] in pieces, as many as it takes, all at one revision. Without a limit, all poses since
    /// the revision that is asked for.
    ///
    /// # Errors
    /// As for a page.
    pub async fn trajectory_pieces(
        &self,
        map: &MapName,
        query: TrajectoryQuery,
    ) -> Result<TrajectoryPieces, ServiceError> {
        let work = async {
            let left = query.limit.map(|limit| self.limits().page(Some(limit))).transpose()?;
            let map = self.map(map).await?;
            let shared = Arc::clone(&map);
            let copy = move |_: StopSignal<'_>| shared.map.trajectory_and_version();
            let copy = self.inner.lanes.queries.run(&self.asker, copy).await?;
            let (trajectory, version) = copy;
            let version = map.version(version);
            Ok(TrajectoryPieces { service: self.clone(), trajectory, version, query, left, ended: false })
        };
        self.observed("StreamTrajectory", Some(map), work, |_| Outcome::Read).await
    }
}

/// The pieces of a trajectory as it was at one revision; each is made when it is asked for.
#[derive(Debug)]
pub struct TrajectoryPieces {
    service: MapService,
    trajectory: Trajectory,
    version: MapVersion,
    /// What is still to come.
    query: TrajectoryQuery,
    /// Poses that may still come, where that is bounded.
    left: Option<usize>,
    ended: bool,
}

impl TrajectoryPieces {
    /// The state that all poses are of.
    pub fn version(&self) -> MapVersion {
        self.version
    }

    /// Bytes of memory that this may come to until the last piece is sent: the trajectory, which the map may cease to
    /// share meanwhile, and three pieces, one that is made, one that waits, one that is sent; a pose takes less than a
    /// KiB in any form.
    pub fn memory_bytes(&self) -> usize {
        self.trajectory.memory_bytes() + 3 * POSES_PER_PIECE * 1024
    }

    /// The next piece; none after the last. The first is there even where it has no pose. Only the last one may say
    /// where more than was asked for begins.
    ///
    /// # Errors
    /// `ResourceExhausted` when too many jobs wait. After an error comes no other piece.
    pub async fn next(&mut self) -> Option<Result<TrajectoryAnswer, ServiceError>> {
        if self.ended {
            return None;
        }
        let most = self.left.map_or(POSES_PER_PIECE, |left| left.min(POSES_PER_PIECE));
        let (trajectory, version, query) = (self.trajectory.clone(), self.version, self.query.clone());
        let page_of = move |_: StopSignal<'_>| page(&trajectory, version, &query, most);
        let piece = self.service.inner.lanes.queries.run(&self.service.asker, page_of).await;
        Some(piece.map(|piece| self.follow(piece)).inspect_err(|_| self.ended = true))
    }

    /// Takes note of where the next piece begins.
    fn follow(&mut self, mut piece: TrajectoryAnswer) -> TrajectoryAnswer {
        self.left = self.left.map(|left| left - piece.poses.len());
        match piece.next_since_revision {
            Some(next) if self.left != Some(0) => {
                self.query.since_revision = next;
                piece.next_since_revision = None;
            }
            _ => self.ended = true,
        }
        piece
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
}

/// At most `most` poses.
fn page(
    trajectory: &Trajectory,
    version: MapVersion,
    query: &TrajectoryQuery,
    most: usize,
) -> TrajectoryAnswer {
    let mut wanted = trajectory.poses_after(query.since_revision, query.robot.as_ref());
    let poses: Vec<_> = wanted.by_ref().take(most).cloned().collect();
    let last = poses.last().map(|pose| pose.revision);
    let next_since_revision = last.filter(|_| wanted.next().is_some());
    TrajectoryAnswer { poses, next_since_revision, version }
}

impl HostedMap {
    /// Refuses a robot that is new to the map where `asker` brought as many into it as one caller may.
    pub(super) fn check_robots_of(
        &self,
        asker: &Asker,
        robot: &RobotName,
        limits: &Limits,
    ) -> Result<(), ServiceError> {
        let (trajectory, most) = (self.map.trajectory(), limits.robots_per_caller_max);
        if most == 0 || trajectory.has_scans_of(robot) {
            return Ok(());
        }
        let has_scans = |robot: &RobotName| trajectory.has_scans_of(robot);
        if self.robots.newcomers.admit(asker, robot, most, has_scans) {
            return Ok(());
        }
        let message = format!(
            "map {} has scans of {most} robots that {asker} brought in, robots_per_caller_max is {most}: robot {robot} \
             is one more; use one of their names, undo all scans of one, or raise the limit",
            self.name
        );
        Err(ServiceError::new(Reason::TooManyRobots, message))
    }

    /// Refuses a robot that has no scans in the map where as many have as may.
    pub(super) fn check_robots(&self, robot: &RobotName, limits: &Limits) -> Result<(), ServiceError> {
        let (trajectory, most) = (self.map.trajectory(), limits.robots_per_map_max);
        if trajectory.has_scans_of(robot) || trajectory.robots_with_scans() < most {
            return Ok(());
        }
        let message = format!(
            "map {} has scans of {} robots, robots_per_map_max is {most}: robot {robot} is one more; use one of their \
             names, undo all scans of one, or raise the limit",
            self.name,
            trajectory.robots_with_scans()
        );
        Err(ServiceError::new(Reason::TooManyRobots, message))
    }
}
