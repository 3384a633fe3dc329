//! Honest callers: a robot, a planner, an operator, and a health check.

use nalgebra::{Translation3, UnitQuaternion};

use crate::fleet::address::{GrpcAddress, HttpAddress};
use crate::fleet::error::FleetError;
use crate::fleet::http::HttpConnection;
use crate::fleet::load::Question;
use crate::fleet::member::Member;
use crate::fleet::robot::TURN_POINTS;
use crate::workload::{Order, Room, Workload};
use mrol_client::{Client, new_session};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MapName, RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_service::{PointCloud, ScanRequest};

/// Of the points of a revolution, one in so many is sent: 21,845 of them.
const ONE_IN: usize = 3;
/// Different scans, which the robot sends again and again.
const SCANS: usize = 20;
/// The way between two scans, meters: a robot that stands is not mapped.
const STEP_M: f64 = 0.3;
/// Points of a planner's query.
const QUERY_POINTS: usize = 10_000;
/// Queries of a planner, which are asked again and again.
const QUERIES: usize = 20;

/// A robot that drives to and fro and inserts what it sees, each scan aligned.
pub(crate) struct MappingRobot {
    client: Client,
    map: MapName,
    robot: RobotName,
    session: SessionName,
    scans: Vec<(PointCloud, Pose)>,
}

impl MappingRobot {
    /// A robot that maps the room.
    pub(crate) async fn new(server: &GrpcAddress, map: &MapName, seed: u64) -> Result<Self, FleetError> {
        let seen = Workload::Room(Room).queries(Order::Scan, SCANS * TURN_POINTS, seed);
        let scan = |(n, points): (usize, &[Point])| {
            let along_m = STEP_M * n.min(SCANS - n) as f64;
            let moved = Pose::from_parts(Translation3::new(along_m, 0.0, 0.0), UnitQuaternion::identity());
            let back = moved.inverse();
            let points: Vec<Point> =
                points.iter().step_by(ONE_IN).map(|point| Point::from(back * point.to_f64())).collect();
            (PointCloud::from(points), seen.map_from_points * moved)
        };
        Ok(Self {
            client: server.connect().await?,
            map: map.clone(),
            robot: RobotName::new("honest").map_err(FleetError::failed)?,
            session: new_session(),
            scans: seen.points.chunks_exact(TURN_POINTS).enumerate().map(scan).collect(),
        })
    }
}

impl Member for MappingRobot {
    async fn carry_out(&mut self, number: u64) -> Result<(), FleetError> {
        let (points, pose) = self.scans[number as usize % self.scans.len()].clone();
        let scan = ScanRequest {
            session: self.session.clone(),
            scan_id: Some(number),
            guess: Guess::Pose(pose),
            ..ScanRequest::new(self.robot.clone(), points)
        };
        let answer = self.client.insert_scan(&self.map, scan).await?;
        match answer.accepted {
            true => Ok(()),
            false => Err(FleetError::failed(format!("a scan was refused: {}", answer.reason))),
        }
    }
}

/// A planner that queries points.
pub(crate) struct QuestioningPlanner {
    client: Client,
    map: MapName,
    question: Question,
}

impl QuestioningPlanner {
    pub(crate) async fn new(server: &GrpcAddress, map: &MapName, seed: u64) -> Result<Self, FleetError> {
        let queries = Workload::Room(Room).queries(Order::Random, QUERIES * QUERY_POINTS, seed);
        let question = Question::of(&queries, QUERY_POINTS, Lookup::Exact);
        Ok(Self { client: server.connect().await?, map: map.clone(), question })
    }
}

impl Member for QuestioningPlanner {
    async fn carry_out(&mut self, number: u64) -> Result<(), FleetError> {
        self.client.query_points(&self.map, self.question.query(number as usize)).await?;
        Ok(())
    }
}

/// What an operator does all the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Routine {
    /// Describes the map.
    Describe,
    /// Takes a snapshot of it.
    Snapshot,
}

/// An operator.
pub(crate) struct Operator {
    client: Client,
    map: MapName,
    routine: Routine,
}

impl Operator {
    pub(crate) async fn new(
        server: &GrpcAddress,
        map: &MapName,
        routine: Routine,
    ) -> Result<Self, FleetError> {
        Ok(Self { client: server.connect().await?, map: map.clone(), routine })
    }
}

impl Member for Operator {
    async fn carry_out(&mut self, _: u64) -> Result<(), FleetError> {
        match self.routine {
            Routine::Describe => self.client.map_info(&self.map).await.map(drop)?,
            Routine::Snapshot => self.client.snapshot_map(&self.map).await.map(drop)?,
        }
        Ok(())
    }
}

/// A health check, which comes on a connection of its own each time.
pub(crate) struct Prober(HttpConnection);

impl Prober {
    pub(crate) fn new(address: &HttpAddress) -> Result<Self, FleetError> {
        HttpConnection::each_time_to(address).map(Self)
    }
}

impl Member for Prober {
    async fn carry_out(&mut self, _: u64) -> Result<(), FleetError> {
        self.0.get().await.map(drop)
    }
}
