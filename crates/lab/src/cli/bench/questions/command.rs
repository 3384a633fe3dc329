//! The command: stages of questions, each beside scans or alone.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::report::Line;
use crate::cli::bench::journal::new_folder;
use crate::cli::bench::workload::{MapOptions, ShotOptions, WorkloadOptions};
use crate::fleet::questions::{Pressure, Questions, Scanner, Told, rays};
use crate::fleet::{ServerProcess, Target};
use crate::workload::Shots;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_client::{Replica, ReplicaOptions};
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{NUMBERS_PER_POSE, Rays, Toward, cast_rays};
use mrol_map::util::StopSignal;
use mrol_service::{MotionCheck, PoseCheck};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench questions                                          a server in a process of its own, on the same cores
  taskset -c 1 mrol-lab bench questions --server-processors 0       server and planner have a core each
  taskset -c 1 mrol-lab bench questions --server-processors 0 --workload site --places 64 --azimuths 80 --rings 20

On the server a map of the workload is made. What is asked of it: messages of 1,000 configurations of an arm of 59 spheres in
8 links, of which nine in ten are free, and then half, on a stream; 256 motions of 0.5 m of a body of 20 spheres, of which
half collide, while 10 scans of 20,000 points come in a second, and the same of a replica; 56,000 poses of a body of four
spheres, 50 times a second; rays, on a stream and in this process. Then scans come in while nobody asks, and while 100
configurations are asked after each. server is its processor time, of one core.";

/// Put planners' questions to a server: answers a second, how long they take, and what scans beside them wait
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::bench) struct QuestionBench {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    shots: ShotOptions,
    /// Messages under way on a stream
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1024))]
    in_flight: u16,
    /// Seconds of each measurement
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Processors of the server, as `taskset -c` names them [default: those of this process]
    #[arg(long, value_name = "LIST")]
    server_processors: Option<String>,
    /// A folder for the server's data [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
}

/// The first question makes the fields of a whole map, however slow the machine.
const UNHURRIED: [(&str, &str); 1] = [("MROL_LIMITS__QUESTION_TIME_MAX_S", "60")];

/// Length of a ray, meters.
const RANGE_M: f64 = 100.0;

/// Configurations that are asked about after a scan.
const FIRST_POSES: usize = 100;

impl QuestionBench {
    pub(in crate::cli::bench) async fn run(self, output: Output) -> Result<(), CliError> {
        let time = Duration::try_from_secs_f64(self.seconds).map_err(CliError::usage)?;
        let folder = new_folder(self.folder.as_deref())?;
        let data_dir = folder.path().join("data");
        let processors = self.server_processors.as_deref();
        let mut server = ServerProcess::start_on(processors, &data_dir, &UNHURRIED).await?;
        let target = self.target(&server).await?;
        output.say(format!("{}: {} voxels", self.workload, count(target.voxels)))?;
        output.say(Line::HEAD)?;
        Stage { options: &self, server: &server, target: &target, time, output: &output }.measure().await?;
        target.delete().await?;
        Ok(server.stop().await?)
    }

    async fn target(&self, server: &ServerProcess) -> Result<Target, CliError> {
        let workload = self.workload.workload();
        let settings = self.map.settings(workload.resolution_m())?;
        Ok(Target::make(server.grpc(), None, workload, settings).await?)
    }
}

/// A server with its map.
struct Stage<'a> {
    options: &'a QuestionBench,
    server: &'a ServerProcess,
    target: &'a Target,
    time: Duration,
    output: &'a Output,
}

impl Stage<'_> {
    async fn measure(&self) -> Result<(), CliError> {
        let copy = Arc::new(self.options.map.map_of(self.options.workload.workload())?);
        let mut questions = Questions::about(&copy, self.options.workload.seed());
        let stream = Pressure::Stream { in_flight: self.options.in_flight.into() };
        self.scans_beside(&mut questions).await?;
        for (what, colliding) in [("arms, 90 % free", 100), ("arms, half free", 500)] {
            let arms = questions.arms(colliding)?;
            self.show(what, &stream.put(self.server, self.target, &arms, self.time).await?)?;
        }
        let cycles = questions.cycles()?;
        let at_50 = Pressure::Calls { per_s: Some(50.0) };
        self.show("cycles", &at_50.put(self.server, self.target, &cycles, self.time).await?)?;
        self.rays(&copy, stream).await?;
        self.motions(&questions.motions()?).await
    }

    /// The same rays over the network and in this process.
    async fn rays(&self, copy: &MultiResolutionMap, stream: Pressure) -> Result<(), CliError> {
        let shots = self.options.shots.of(&self.options.workload);
        let messages = rays(&shots, RANGE_M);
        self.show("rays", &stream.put(self.server, self.target, &messages, self.time).await?)?;
        self.show("rays, in process", &cast(copy, &shots, self.time)?)
    }

    /// Motions while scans come in; and of a replica, alone.
    async fn motions(&self, motions: &MotionCheck) -> Result<(), CliError> {
        let (time, all) = (self.time, std::slice::from_ref(motions));
        let mut scanner = self.scanner(self.target).await?;
        let calls = Pressure::Calls { per_s: None };
        let (asked, scans) = tokio::join!(
            calls.put(self.server, self.target, all, time),
            scanner.work(self.server, time + time / 10, &[])
        );
        self.show("motions beside scans", &asked?)?;
        drop(scans?);
        self.show("motions of a replica", &self.of_a_replica(motions).await?)
    }

    async fn of_a_replica(&self, motions: &MotionCheck) -> Result<Told, CliError> {
        let client = self.server.grpc().connect().await?;
        let replica = Replica::open(client, self.target.map.clone(), ReplicaOptions::default()).await;
        let replica = replica.map_err(CliError::failed)?;
        replica.ask(motions).map_err(CliError::failed)?;
        timed(self.time, motions.lengths.len(), || replica.ask(motions).map(drop).map_err(CliError::failed))
    }

    /// Scans into a map of which nobody asks, and into one that is asked about after each.
    async fn scans_beside(&self, questions: &mut Questions) -> Result<(), CliError> {
        let arms = questions.arms(500)?;
        let few: Vec<PoseCheck> = arms.iter().map(few).collect();
        let other = self.options.target(self.server).await?;
        let [alone, _] = self.scanner(&other).await?.work(self.server, self.time, &[]).await?;
        self.show("scans, nobody asks", &alone)?;
        Pressure::Calls { per_s: None }.put(self.server, &other, &arms, self.time / 10).await?;
        let beside = self.scanner(&other).await?.work(self.server, self.time, &few).await;
        other.delete().await?;
        let [scans, checks] = beside?;
        self.show("scans, 100 asked after", &scans)?;
        self.show("the 100", &checks)
    }

    async fn scanner(&self, target: &Target) -> Result<Scanner, CliError> {
        let workload = (self.options.workload.workload(), self.options.workload.seed());
        Ok(Scanner::new(self.server, target, workload, self.time).await?)
    }

    fn show(&self, what: &'static str, told: &Told) -> Result<(), CliError> {
        self.output.print(&Line::of(what, told))
    }
}

/// The first configurations of a check.
fn few(check: &PoseCheck) -> PoseCheck {
    let each = check.body.links().len() * NUMBERS_PER_POSE;
    PoseCheck { configurations: check.configurations[..FIRST_POSES * each].to_vec(), ..check.clone() }
}

/// Casts all rays again and again.
fn cast(map: &MultiResolutionMap, shots: &Shots, time: Duration) -> Result<Told, CliError> {
    let toward = Toward::Directions { directions: &shots.directions, range_m: RANGE_M };
    let rays = Rays { origins: &shots.origins, toward };
    timed(time, rays.len(), || {
        cast_rays(&map.view(), &rays, 0, StopSignal::NEVER).map(drop).map_err(CliError::usage)
    })
}

/// Does something about `items` things again and again, for `time`.
fn timed(
    time: Duration,
    items: usize,
    mut f: impl FnMut() -> Result<(), CliError>,
) -> Result<Told, CliError> {
    let (mut told, start) = (Told::nothing()?, Instant::now());
    while start.elapsed() < time {
        let asked = Instant::now();
        f()?;
        told.add(asked, items);
    }
    told.seconds = start.elapsed().as_secs_f64();
    Ok(told)
}
