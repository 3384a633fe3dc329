//! The server, the robot that maps, and the replicas that follow.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::time::sleep;

use super::report::{Line, Measured};
use crate::cli::bench::workload::{MapOptions, WorkloadOptions};
use crate::fleet::{
    ANY_PORT, Fleet, FleetError, Ledger, Seen, ServerProcess, Spectator, StalledWatch, Surveyor, TURN_POINTS,
    Tally, Target, Working,
};
use crate::workload::Order;
use mrol::console::error::CliError;

/// Revolutions of the workload's sensor, which the robot sends repeatedly.
const TURNS: usize = 50;
/// How long replicas may take to have what was acknowledged.
const PATIENCE: Duration = Duration::from_secs(60);
/// Watchers that read nothing are kept for the whole stage.
const SETTINGS: [(&str, &str); 1] = [("MROL_LIMITS__WATCH_UNREAD_MAX_S", "3600")];
/// With these nothing is kept of the journal but what the newest two snapshots need,
const SHORT_JOURNAL: [(&str, &str); 2] =
    [("MROL_STORE__UNDO_REVISIONS", "0"), ("MROL_STORE__UNDO_BYTES_MAX", "0")];
/// of which each end of a server writes one.
const STARTS_AWAY: usize = 3;

/// A server with a map that is mapped, and its watchers.
pub(super) struct Stage {
    data: PathBuf,
    server: ServerProcess,
    /// Where the server was first, and comes back to.
    home: String,
    target: Target,
    ledger: Arc<Ledger>,
    seen: Seen,
    robots: Option<Fleet<Surveyor>>,
    rate: f64,
    spectators: Vec<Spectator>,
}

impl Stage {
    /// Starts the server and makes the map.
    pub(super) async fn set(
        workload_options: &WorkloadOptions,
        map_options: &MapOptions,
        scan_points: u32,
        rate: f64,
        data: &Path,
    ) -> Result<Self, CliError> {
        let server = ServerProcess::start_at(data, ANY_PORT, &SETTINGS).await?;
        let workload = workload_options.workload();
        let settings = map_options.settings(workload.resolution_m())?;
        let target = Target::make(server.grpc(), None, workload, settings).await?;
        let turns = workload.queries(Order::Scan, TURN_POINTS * TURNS, workload_options.seed());
        let seen = Seen::of(&turns, scan_points as usize);
        let ledger = Arc::new(Ledger::default());
        let robot = Surveyor::new(&server.grpc(), &target.map, &seen, &ledger).await?;
        let (data, home) = (data.to_owned(), server.grpc_listen().to_owned());
        let (robots, spectators) = (Some(Fleet::new(vec![robot])), Vec::new());
        Ok(Self { data, server, home, target, ledger, seen, robots, rate, spectators })
    }

    /// Deletes the map and ends the server.
    pub(super) async fn clear(mut self) -> Result<(), FleetError> {
        self.spectators.clear();
        self.target.delete().await?;
        self.server.stop().await
    }

    /// Opens replicas.
    pub(super) async fn admit(&mut self, replicas: u16) -> Result<(), FleetError> {
        for _ in 0..replicas {
            self.spectators.push(Spectator::open(&self.server.grpc(), &self.target.map).await?);
        }
        Ok(())
    }

    /// Begins a watch that is never read.
    pub(super) async fn admit_stalled(&self) -> Result<StalledWatch, FleetError> {
        StalledWatch::begin(&self.server.http().url, &self.target.map).await
    }

    /// Voxels of the map in the beginning.
    pub(super) fn voxels(&self) -> usize {
        self.target.voxels
    }

    /// Inserts scans for `time`.
    pub(super) async fn scans(&mut self, name: &'static str, time: Duration) -> Result<Line, FleetError> {
        let (begin, cpu) = (Instant::now(), self.server.cpu_seconds()?);
        let commits = self.begin_to_map(time)?.end().await?;
        let cpu = (self.server.cpu_seconds()? - cpu) / begin.elapsed().as_secs_f64();
        self.line(name, commits, Some(cpu)).await
    }

    /// Inserts scans for `time`; after half of it the server is killed and started.
    pub(super) async fn scans_and_a_kill(
        &mut self,
        name: &'static str,
        time: Duration,
    ) -> Result<Line, FleetError> {
        let mapping = self.begin_to_map(time)?;
        sleep(time / 2).await;
        self.server.kill().await?;
        self.server = ServerProcess::start_at(&self.data, &self.home, &SETTINGS).await?;
        self.line(name, mapping.end().await?, None).await
    }

    /// Lets the server work elsewhere until its journal does not reach back to what the replicas have, and then come
    /// back.
    pub(super) async fn away(&mut self, name: &'static str, time: Duration) -> Result<Line, FleetError> {
        for _ in 0..STARTS_AWAY {
            self.server.stop().await?;
            self.server = ServerProcess::start_at(&self.data, ANY_PORT, &SHORT_JOURNAL).await?;
            let robot =
                Surveyor::new(&self.server.grpc(), &self.target.map, &self.seen, &self.ledger).await?;
            let mapping = Fleet::new(vec![robot]).work(Some(self.rate), time / STARTS_AWAY as u32)?;
            let (_, tally) = mapping.end().await?;
            if let Some((error, _)) = tally.errors.first_key_value() {
                return Err(FleetError::Failed(error.clone()));
            }
        }
        self.server.stop().await?;
        self.server = ServerProcess::start_at(&self.data, &self.home, &SETTINGS).await?;
        let commits = self.begin_to_map(time)?.end().await?;
        self.line(name, commits, None).await
    }

    /// Lets the robot map for `time`.
    fn begin_to_map(&mut self, time: Duration) -> Result<Working<Surveyor>, FleetError> {
        let at_work = || FleetError::Failed("the robot is at work".into());
        self.robots.take().ok_or_else(at_work)?.work(Some(self.rate), time)
    }

    /// Waits until all replicas have what was acknowledged, and compares what they saw.
    async fn line(
        &mut self,
        stage: &'static str,
        (robots, commits): (Fleet<Surveyor>, Tally),
        server_cpu: Option<f64>,
    ) -> Result<Line, FleetError> {
        self.robots = Some(robots);
        let (begin, head) = (Instant::now(), self.ledger.head());
        let mut seen = Tally::new()?;
        for spectator in &self.spectators {
            spectator.wait_for(head, PATIENCE).await?;
        }
        let behind = begin.elapsed();
        for spectator in &self.spectators {
            seen.merge(&self.ledger.compare(&spectator.take_seen())?)?;
        }
        let resets = self.spectators.iter().map(|spectator| spectator.status().resets).collect::<Vec<_>>();
        let resident_bytes = self.server.resident_bytes()?;
        Ok(Line::of(stage, &commits, &seen, Measured { behind, server_cpu, resident_bytes, resets }))
    }
}
