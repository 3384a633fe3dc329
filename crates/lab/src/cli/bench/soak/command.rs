//! The command: a fleet that works for an hour, and what is measured meanwhile.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::time::sleep;

use super::report::{Done, Line, Verdict};
use crate::cli::bench::journal::new_folder;
use crate::cli::bench::workload::{MapOptions, WorkloadOptions};
use crate::fleet::{
    Fleet, FleetError, Planner, Question, Robot, Seen, ServerProcess, TURN_POINTS, Tally, Target, Trend,
};
use crate::workload::Order;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_map::map::Lookup;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench soak                                  an hour at 80 % of what the machine can do
  mrol-lab bench soak --seconds 60 --report-seconds 5 --load 0.5
  mrol-lab bench soak --workload site --folder /mnt/data --json > soak.json

A server is started as a process of its own. Planners ask, over gRPC, streams and HTTP in turn. Robots go on missions:
each makes a map, inserts scans, aligned and not, deletes, undoes half of them, adds a scan to the map that the planners
ask, and deletes its own. First they work without a pause: that is the capacity. Then at --load of it, and times count
from the moment when an operation was due, whoever is late. The exit code says whether nothing failed, the load was
carried out, and memory was flat over the second half.";

/// Time between two measurements of the server's memory.
const MEASURED_EVERY: Duration = Duration::from_secs(1);

/// Number of revolutions of the workload's sensor, which the robots send repeatedly.
const TURNS: usize = 50;

/// Run a server for an hour under a fleet's load: nothing may fail, and memory may not grow
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::bench) struct Soak {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Seconds at the load
    #[arg(long, default_value_t = 3600.0, value_parser = seconds)]
    seconds: f64,
    /// Load, as a share of the capacity
    #[arg(long, default_value_t = 0.8, value_parser = share)]
    load: f64,
    /// Seconds for which the capacity is measured
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    capacity_seconds: f64,
    /// Seconds between two lines
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    report_seconds: f64,
    /// Largest growth of memory over the second half, by the line through its measurements, as a share
    #[arg(long, value_name = "SHARE", default_value_t = 0.03, value_parser = share)]
    growth_max: f64,
    /// Largest share of the operations that were due and are not done when the time is over
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = share)]
    left_max: f64,
    /// Number of clients that query
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=256))]
    planners: u16,
    /// Number of clients that map
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=256))]
    robots: u16,
    /// Points of a query
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    query_points: u32,
    /// Points of an aligned scan, at most
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(100..=TURN_POINTS as i64))]
    scan_points: u32,
    /// A folder for the server's data [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
}

impl Soak {
    pub(in crate::cli::bench) async fn run(self, output: Output) -> Result<(), CliError> {
        let folder = new_folder(self.folder.as_deref())?;
        let mut server = ServerProcess::start(folder.path()).await?;
        let workload = self.workload.workload();
        let settings = self.map.settings(workload.resolution_m())?;
        let target = Target::make(server.grpc(), Some(server.http()), workload, settings).await?;
        let (planners, robots) = (self.planners(&target).await?, self.robots(&target).await?);
        let (workload, voxels) = (&self.workload, count(target.voxels));
        output.say(format!(
            "{workload}: {voxels} voxels, {} planners, {} robots",
            self.planners, self.robots
        ))?;

        let (planners, robots, capacity) = self.capacity(planners, robots).await?;
        let [queries, changes] = capacity;
        output.say(format!("capacity: {queries:.0} queries and {changes:.0} changes a second"))?;
        let verdict = self.soak(planners, robots, capacity, &server, &output).await?;
        output.print(&verdict)?;
        target.delete().await?;
        server.stop().await?;
        verdict
            .complaint(self.growth_max, self.left_max)
            .map_or(Ok(()), |complaint| Err(CliError::failed(complaint)))
    }

    async fn planners(&self, target: &Target) -> Result<Fleet<Planner>, CliError> {
        let question = Question::of(&self.workload.queries(1), self.query_points as usize, Lookup::Exact);
        let mut planners = Vec::new();
        for _ in 0..self.planners {
            planners.push(Planner::new(target, question.clone()).await?);
        }
        Ok(Fleet::new(planners))
    }

    async fn robots(&self, target: &Target) -> Result<Fleet<Robot>, CliError> {
        let (workload, seed) = (self.workload.workload(), self.workload.seed());
        let seen = workload.queries(Order::Scan, TURN_POINTS * TURNS, seed);
        let seen = Seen::of(&seen, self.scan_points as usize);
        let mut robots = Vec::new();
        for number in 0..self.robots {
            robots.push(Robot::new(number, target, seen.clone()).await?);
        }
        Ok(Fleet::new(robots))
    }

    /// Measures the capacity: queries and changes a second, without a pause and at the same time.
    async fn capacity(
        &self,
        planners: Fleet<Planner>,
        robots: Fleet<Robot>,
    ) -> Result<(Fleet<Planner>, Fleet<Robot>, [f64; 2]), CliError> {
        let (start, time) = (Instant::now(), Duration::from_secs_f64(self.capacity_seconds));
        let (planning, mapping) = (planners.work(None, time)?, robots.work(None, time)?);
        let (planners, queries) = planning.end().await?;
        let (robots, changes) = mapping.end().await?;
        if let Some((error, times)) = queries.errors.first_key_value().or(changes.errors.first_key_value()) {
            return Err(CliError::failed(format!("while measuring the capacity, {times} times: {error}")));
        }
        let per_s = |tally: &Tally| tally.operations() as f64 / start.elapsed().as_secs_f64();
        Ok((planners, robots, [per_s(&queries), per_s(&changes)]))
    }

    async fn soak(
        &self,
        planners: Fleet<Planner>,
        robots: Fleet<Robot>,
        capacity: [f64; 2],
        server: &ServerProcess,
        output: &Output,
    ) -> Result<Verdict, CliError> {
        output.say(Line::HEAD)?;
        let time = Duration::from_secs_f64(self.seconds);
        let rates = capacity.map(|capacity| capacity * self.load);
        let (start, mut reported) = (Instant::now(), Instant::now());
        let (planning, mapping) = (planners.work(Some(rates[0]), time)?, robots.work(Some(rates[1]), time)?);
        let (mut memory, mut all) = (Vec::new(), [Tally::new()?, Tally::new()?]);
        while start.elapsed() < time {
            sleep(MEASURED_EVERY.min(time.saturating_sub(start.elapsed()))).await;
            let (seconds, resident_bytes) = (start.elapsed().as_secs_f64(), server.resident_bytes()?);
            memory.push((seconds, resident_bytes as f64));
            let lasted = reported.elapsed().as_secs_f64();
            if lasted >= self.report_seconds || start.elapsed() >= time {
                let tallies = [planning.tally()?, mapping.tally()?];
                let [queries, changes] = tallies.each_ref().map(|tally| Done::of(tally, lasted));
                output.print(&Line { seconds, queries, changes, resident_bytes })?;
                merge(&mut all, &tallies)?;
                reported = Instant::now();
            }
        }
        let done = all.each_ref().map(|tally| Done::of(tally, start.elapsed().as_secs_f64()));
        merge(&mut all, &[planning.end().await?.1, mapping.end().await?.1])?;
        for (error, times) in all.iter().flat_map(|tally| &tally.errors) {
            output.note(format!("{times} times: {error}"));
        }
        memory.retain(|(seconds, _)| *seconds >= self.seconds / 2.0);
        let trend =
            Trend::of(&memory).ok_or_else(|| CliError::usage("--seconds is too short for a trend"))?;
        Ok(Verdict::of(self.seconds, self.load, rates.iter().sum(), done, trend))
    }
}

fn merge(all: &mut [Tally; 2], more: &[Tally; 2]) -> Result<(), FleetError> {
    all.iter_mut().zip(more).try_for_each(|(all, more)| all.merge(more))
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, 0.1, 1e6)
}

fn share(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1.0)
}

fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    (least..=most)
        .contains(&number)
        .then_some(number)
        .ok_or_else(|| format!("{least} to {most}, got {number}"))
}
