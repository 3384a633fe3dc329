//! Robots: members of a fleet that map.

use std::sync::Arc;

use super::error::FleetError;
use super::member::Member;
use super::target::Target;
use crate::workload::Queries;
use mrol_client::{Client, NewMap, new_session};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapName, Region, RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_service::{Deletion, DeletionTarget, PointCloud, ScanRequest, Undo, UndoTarget};

/// Points of one revolution of the workload's sensor.
pub(crate) const TURN_POINTS: usize = 64 * 1024;
/// Number of scans of a mission.
const SCANS: u64 = 20;
/// Radius of a deletion, meters.
const DELETED_RADIUS_M: f64 = 0.3;

/// Scans of the workload, one for each revolution of the sensor.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    turns: Arc<[PointCloud]>,
    map_from_points: Pose,
}

impl Seen {
    /// Divides `points` into whole revolutions, each thinned evenly to at most `scan_points` points.
    pub(crate) fn of(points: &Queries, scan_points: usize) -> Self {
        let every = TURN_POINTS.div_ceil(scan_points);
        let thinned = |turn: &[Point]| turn.iter().copied().step_by(every).collect::<Vec<_>>().into();
        let turns = points.points.chunks_exact(TURN_POINTS).map(thinned).collect();
        Self { turns, map_from_points: points.map_from_points }
    }

    /// The scan of revolution `number`, as a robot sends it where it was; the revolutions repeat.
    pub(super) fn scan(&self, robot: &RobotName, session: &SessionName, number: u64) -> ScanRequest {
        ScanRequest {
            session: session.clone(),
            scan_id: Some(number),
            guess: Guess::Pose(self.map_from_points),
            ..ScanRequest::new(robot.clone(), self.turn(number))
        }
    }

    /// The ball around one point of a revolution.
    pub(super) fn ball(&self, number: u64, radius_m: f64) -> Result<Region, FleetError> {
        let turn = self.turn(number);
        let seen = turn.as_slice()[number as usize * 7919 % turn.len()];
        let center_m = (self.map_from_points * seen.to_f64()).into();
        Region::ball(center_m, radius_m).map_err(FleetError::failed)
    }

    fn turn(&self, number: u64) -> PointCloud {
        self.turns[number as usize % self.turns.len()].clone()
    }
}

/// A robot that carries out one mission after another, each with a map of its own that is deleted at its end. One scan
/// of each mission goes to the map that all robots share.
pub(crate) struct Robot {
    name: RobotName,
    client: Client,
    seen: Seen,
    /// Session of the robot's scans.
    session: SessionName,
    /// Name of the shared map.
    shared: MapName,
    /// Name of the mission's map.
    own: MapName,
    settings: NewMap,
    /// Number of completed steps of the mission.
    steps: u64,
    /// Revision of the mission's map after half of its scans.
    half_way: u64,
}

/// A step of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    MakeMap,
    Scan,
    Delete,
    UndoHalf,
    ScanForAll,
    DeleteForAll,
    DeleteMap,
}

impl Step {
    /// The step that follows `steps` steps of a mission.
    fn after(steps: u64) -> Self {
        match steps.checked_sub(SCANS) {
            None if steps == 0 => Self::MakeMap,
            None | Some(0) => Self::Scan,
            Some(1) => Self::Delete,
            Some(2) => Self::UndoHalf,
            Some(3) => Self::ScanForAll,
            Some(4) => Self::DeleteForAll,
            Some(_) => Self::DeleteMap,
        }
    }
}

impl Robot {
    pub(crate) async fn new(number: u16, target: &Target, seen: Seen) -> Result<Self, FleetError> {
        let name = format!("soak-{number}");
        Ok(Self {
            own: MapName::new(&format!("{name}-own")).map_err(FleetError::failed)?,
            name: RobotName::new(&name).map_err(FleetError::failed)?,
            session: new_session(),
            client: target.grpc.connect().await?,
            seen,
            shared: target.map.clone(),
            settings: NewMap::of(target.resolution_m),
            steps: 0,
            half_way: 0,
        })
    }

    /// Inserts a revolution, aligned or at its guess; returns the revision. All revolutions fit, so that a refused one
    /// is an error.
    async fn insert(&self, map: &MapName, number: u64, at_guess: bool) -> Result<u64, FleetError> {
        let scan = ScanRequest { at_guess, ..self.seen.scan(&self.name, &self.session, number) };
        let answer = self.client.insert_scan(map, scan).await?;
        match answer.accepted {
            true => Ok(answer.version.revision),
            false => Err(FleetError::failed(format!("a scan was refused: {}", answer.reason))),
        }
    }

    /// Deletes the voxels around one point of a revolution.
    async fn delete(&self, map: &MapName, number: u64) -> Result<(), FleetError> {
        let ball = self.seen.ball(number, DELETED_RADIUS_M)?;
        let deletion = Deletion { target: DeletionTarget::Region(ball), level: 0, request_id: None };
        self.client.delete_voxels(map, deletion).await?;
        Ok(())
    }

    /// Undoes the scans since half of the mission.
    async fn undo_half(&self) -> Result<(), FleetError> {
        let target = UndoTarget::RobotSince { robot: self.name.clone(), revision: self.half_way };
        self.client.undo(&self.own, Undo { target, request_id: None }).await?;
        Ok(())
    }
}

impl Member for Robot {
    async fn carry_out(&mut self, number: u64) -> Result<(), FleetError> {
        let step = Step::after(self.steps);
        self.steps = if step == Step::DeleteMap { 0 } else { self.steps + 1 };
        match step {
            Step::MakeMap => self.client.create_map(&self.own, self.settings).await.map(drop)?,
            Step::Scan => {
                // A few thinned turns are too little for others to overlap with.
                let at_guess = self.steps <= SCANS / 2;
                let revision = self.insert(&self.own, number, at_guess).await?;
                if self.steps == SCANS / 2 {
                    self.half_way = revision;
                }
            }
            Step::Delete => self.delete(&self.own, number).await?,
            Step::UndoHalf => self.undo_half().await?,
            Step::ScanForAll => drop(self.insert(&self.shared, number, false).await?),
            Step::DeleteForAll => self.delete(&self.shared, number).await?,
            Step::DeleteMap => self.client.delete_map(&self.own).await?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mission_is_scans_and_what_becomes_of_them() {
        let steps: Vec<_> = (0..).map(Step::after).take_while(|step| *step != Step::DeleteMap).collect();
        assert_eq!(steps.iter().filter(|step| **step == Step::Scan).count() as u64, SCANS);
        assert_eq!((steps[0], steps.len() as u64), (Step::MakeMap, SCANS + 5));
    }
}
