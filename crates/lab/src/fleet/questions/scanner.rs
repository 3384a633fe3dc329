//! A robot whose scans come in ten times a second.

use std::time::{Duration, Instant};

use super::load::Told;
use crate::fleet::error::FleetError;
use crate::fleet::pace::Pace;
use crate::fleet::process::ServerProcess;
use crate::fleet::target::Target;
use crate::workload::{Order, Workload};
use mrol_client::{Client, new_session};
use mrol_map::geometry::Pose;
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_service::{PointCloud, PoseCheck, ScanRequest};

/// Points of a scan.
const SCAN_POINTS: usize = 20_000;
/// Scans a second.
const SCANS_PER_S: f64 = 10.0;

/// A robot that is where it says, and its scans.
pub(crate) struct Scanner {
    client: Client,
    map: MapName,
    robot: RobotName,
    session: SessionName,
    map_from_points: Pose,
    scans: Vec<PointCloud>,
    next: usize,
}

impl Scanner {
    /// A robot that scans what a workload has, with as many scans as come in within `time`.
    pub(crate) async fn new(
        server: &ServerProcess,
        target: &Target,
        (workload, seed): (Workload, u64),
        time: Duration,
    ) -> Result<Self, FleetError> {
        let scans = (time.as_secs_f64() * SCANS_PER_S).ceil() as usize + 1;
        let seen = workload.queries(Order::Scan, scans * SCAN_POINTS, seed);
        Ok(Self {
            client: server.grpc().connect().await?,
            map: target.map.clone(),
            robot: RobotName::new("scanner").map_err(FleetError::failed)?,
            session: new_session(),
            map_from_points: seen.map_from_points,
            scans: seen.points.chunks(SCAN_POINTS).map(|scan| PointCloud::from(scan.to_vec())).collect(),
            next: 0,
        })
    }

    /// Inserts scans for `time`; how long each took. After each, one of `firsts` is asked, where there are some: how
    /// long that took comes second.
    pub(crate) async fn work(
        &mut self,
        server: &ServerProcess,
        time: Duration,
        firsts: &[PoseCheck],
    ) -> Result<[Told; 2], FleetError> {
        let [mut scans, mut checks] = [Told::nothing()?, Told::nothing()?];
        let (pace, cpu_s, start) =
            (Pace::new(Some(SCANS_PER_S), time, 0), server.cpu_seconds()?, Instant::now());
        while pace.due().await.is_some() {
            let asked = Instant::now();
            self.insert().await?;
            scans.add(asked, 1);
            if let Some(check) = firsts.get(self.next % firsts.len().max(1)) {
                let asked = Instant::now();
                self.client.check_poses(&self.map, check.clone()).await?;
                checks.add(asked, 1);
            }
        }
        scans.seconds = start.elapsed().as_secs_f64();
        scans.server_cpu_s = server.cpu_seconds()? - cpu_s;
        Ok([scans, checks])
    }

    async fn insert(&mut self) -> Result<(), FleetError> {
        let scan = ScanRequest {
            session: self.session.clone(),
            scan_id: Some(self.next as u64),
            guess: Guess::Pose(self.map_from_points),
            at_guess: true,
            ..ScanRequest::new(self.robot.clone(), self.scans[self.next % self.scans.len()].clone())
        };
        self.next += 1;
        self.client.insert_scan(&self.map, scan).await.map(drop).map_err(FleetError::from)
    }
}
