//! The command: the honest callers alone, then beside the attackers.

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum as _;
use tempfile::TempDir;
use tokio::time::{MissedTickBehavior, interval};

use super::report::{CALLERS, Goals, Line, write};
use crate::fleet::attack::{
    Aim, Assailants, Attack, Damage, Holder, KeyRing, MappingRobot, Operator, Prober, QuestioningPlanner,
    Routine,
};
use crate::fleet::{Fleet, FleetError, ServerProcess, Tally, Target, Working};
use crate::workload::{Room, Site, Workload};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_client::NewMap;
use mrol_map::map::{MapName, MapSettings};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment attack                                     ten minutes of every attack at once
  mrol-lab experiment attack --seconds 120 --out results/
  mrol-lab experiment attack --attacks listings,counts --seconds 60
  mrol-lab experiment attack --program target/release/mrol       another build of the server

A server is started as a process of its own, with a key for each caller. Honest callers use one map: a robot that inserts
and aligns 10 scans of 21,845 points a second, a planner that asks about 10,000 points 10 times a second, an operator who has
the map described 5 times a second and takes a snapshot a minute, and health checks, 20 a second, each on a connection of
its own. First they are alone. Then others join, with a key that may read and one that may insert, in a process of the
lowest priority, each asking again as soon as it is answered.

Times are the clients': from the moment when a request was due to its answer. A caller that waits longer than a period goes on with
the newest request that is due: the others count as left out. So the times count what the machine itself keeps waiting;
give it nothing else to do meanwhile. The exit code says whether the goals were met.";

/// What honest callers wait for while others ask for all that they may
#[derive(Debug, clap::Args)]
#[command(name = "attack", after_help = EXAMPLES)]
pub(in crate::cli::experiment) struct AttackExperiment {
    /// How long the attack is, seconds
    #[arg(long, default_value_t = 600.0, value_parser = seconds)]
    seconds: f64,
    /// How long the honest callers are alone, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    alone_seconds: f64,
    /// The attacks, separated by commas [default: all of them]
    #[arg(long, value_enum, value_delimiter = ',')]
    attacks: Vec<Attack>,
    /// The program that serves, as `mrol serve` does [default: this one]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Where to write attack.csv and attack.md; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Voxels of the large map, about
    #[arg(long, value_name = "N", default_value_t = 2_000_000, value_parser = clap::value_parser!(u64).range(Site::VOXELS_RANGE))]
    site_voxels: u64,
    /// Seed of the maps, and of what is asked and sent
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    goals: Goals,
}

impl AttackExperiment {
    pub(in crate::cli::experiment) async fn run(self, output: Output) -> Result<(), CliError> {
        let folder = TempDir::new().map_err(CliError::failed)?;
        let keys = KeyRing::make(folder.path())?;
        let file = keys.file().display().to_string();
        let settings = [("MROL_ACCESS__KEYS_FILE", &*file)];
        let data_dir = folder.path().join("data");
        let mut server = ServerProcess::start_program(self.program.as_deref(), &data_dir, &settings).await?;
        let done = self.measure(&server, &keys, &output).await;
        server.stop().await?;
        done
    }

    async fn measure(&self, server: &ServerProcess, keys: &KeyRing, output: &Output) -> Result<(), CliError> {
        let scene = Scene::make(server, keys, self.site_voxels as usize, self.seed).await?;
        let (shared, large) = (count(scene.shared.voxels), count(scene.large.voxels));
        output.say(format!("a map of {shared} voxels for all, one of {large} for the attackers"))?;
        let honest = Honest::new(&scene, self.seed).await?;
        let (honest, alone) = honest.work(self.alone_seconds, output).await?;
        let mut assailants =
            Assailants::start(&scene.aim(), &self.attacks(), self.seconds, self.seed).await?;
        let (_, attacked) = honest.work(self.seconds, output).await?;
        let damages = assailants.end().await?;
        let lines = Line::all((&alone, self.alone_seconds), (&attacked, self.seconds));
        output.say(Line::HEAD)?;
        lines.iter().try_for_each(|line| output.print(line))?;
        output.say("")?;
        output.say(Damage::HEAD)?;
        damages.iter().try_for_each(|damage| output.print(damage))?;
        for ((caller, _), tally) in CALLERS.iter().zip(&attacked) {
            for (error, times) in &tally.errors {
                output.note(format!("{caller}, {times} times: {error}"));
            }
        }
        if let Some(out) = &self.out {
            write(&lines, &damages, out)?;
        }
        self.goals.complaint(&lines).map_or(Ok(()), |complaint| Err(CliError::failed(complaint)))
    }

    fn attacks(&self) -> Vec<Attack> {
        if self.attacks.is_empty() { Attack::value_variants().to_vec() } else { self.attacks.clone() }
    }
}

/// A server with its maps and its keys.
struct Scene<'a> {
    server: &'a ServerProcess,
    keys: &'a KeyRing,
    shared: Target,
    large: Target,
    own: MapName,
}

impl<'a> Scene<'a> {
    async fn make(
        server: &'a ServerProcess,
        keys: &'a KeyRing,
        site_voxels: usize,
        seed: u64,
    ) -> Result<Self, FleetError> {
        let admin = keys.grpc(server, Holder::Admin)?;
        let own = MapName::new("attackers").map_err(|error| FleetError::Failed(error.to_string()))?;
        admin.connect().await?.create_map(&own, NewMap::of(Room::RESOLUTION_M)).await?;
        let map = async |workload: Workload| {
            let settings = MapSettings::new(workload.resolution_m(), mrol_map::map::LEVELS_DEFAULT);
            Target::make(admin.clone(), None, workload, settings).await
        };
        let shared = map(Workload::Room(Room)).await?;
        let large = map(Workload::Site(Site::of(site_voxels, seed))).await?;
        Ok(Self { server, keys, shared, large, own })
    }

    fn aim(&self) -> Aim {
        Aim {
            grpc: self.server.grpc().url,
            http: self.server.http().url,
            shared: self.shared.map.clone(),
            large: self.large.map.clone(),
            own: self.own.clone(),
            reader: self.keys.secret(Holder::Reader).to_owned(),
            inserter: self.keys.secret(Holder::Inserter).to_owned(),
        }
    }
}

/// The honest callers.
struct Honest {
    robot: Fleet<MappingRobot>,
    planner: Fleet<QuestioningPlanner>,
    describing: Fleet<Operator>,
    saving: Fleet<Operator>,
    readiness: Fleet<Prober>,
    probe: Fleet<Prober>,
}

impl Honest {
    async fn new(scene: &Scene<'_>, seed: u64) -> Result<Self, FleetError> {
        let (server, keys, map) = (scene.server, scene.keys, &scene.shared.map);
        let grpc = |holder| keys.grpc(server, holder);
        let operator = async |routine| Operator::new(&grpc(Holder::Operator)?, map, routine).await;
        let prober = |path| Prober::new(&keys.http(server, Holder::Operator, path)?);
        let robot = MappingRobot::new(&grpc(Holder::Robot)?, map, seed).await?;
        let planner = QuestioningPlanner::new(&grpc(Holder::Planner)?, map, seed).await?;
        Ok(Self {
            robot: Fleet::new(vec![robot]),
            planner: Fleet::new(vec![planner]),
            describing: Fleet::new(vec![operator(Routine::Describe).await?]),
            saving: Fleet::new(vec![operator(Routine::Snapshot).await?]),
            readiness: Fleet::new(vec![prober("/readyz")?]),
            probe: Fleet::new(vec![prober("/livez")?]),
        })
    }

    /// Works for some time; the tallies are in the order of [`CALLERS`].
    async fn work(self, seconds: f64, output: &Output) -> Result<(Self, Vec<Tally>), FleetError> {
        let time = Duration::from_secs_f64(seconds);
        let bar = output.clone().with_bar_of(seconds.ceil() as usize, "seconds");
        let ticking = tokio::spawn(async move {
            let mut ticks = interval(Duration::from_secs(1));
            ticks.set_missed_tick_behavior(MissedTickBehavior::Burst);
            ticks.tick().await;
            for _ in 0..seconds.ceil() as usize {
                ticks.tick().await;
                bar.step();
            }
            bar.clear_bar();
        });
        let rates = CALLERS.map(|(_, per_s)| per_s);
        let robot = self.robot.work_skipping(rates[0], time)?;
        let planner = self.planner.work_skipping(rates[1], time)?;
        let describing = self.describing.work_skipping(rates[2], time)?;
        let saving = self.saving.work_skipping(rates[3], time)?;
        let readiness = self.readiness.work_skipping(rates[4], time)?;
        let probe = self.probe.work_skipping(rates[5], time)?;
        let mut tallies = Vec::new();
        let honest = Self {
            robot: ended(robot, &mut tallies).await?,
            planner: ended(planner, &mut tallies).await?,
            describing: ended(describing, &mut tallies).await?,
            saving: ended(saving, &mut tallies).await?,
            readiness: ended(readiness, &mut tallies).await?,
            probe: ended(probe, &mut tallies).await?,
        };
        ticking.abort();
        Ok((honest, tallies))
    }
}

async fn ended<M: crate::fleet::Member>(
    working: Working<M>,
    tallies: &mut Vec<Tally>,
) -> Result<Fleet<M>, FleetError> {
    let (fleet, tally) = working.end().await?;
    tallies.push(tally);
    Ok(fleet)
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    (0.5..=1e6).contains(&seconds).then_some(seconds).ok_or_else(|| format!("0.5 to 1e6, got {seconds}"))
}
