//! The command `mrol demo`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::checks::Checks;
use super::daemon::Daemon;
use super::journal::Journal;
use super::planner::Planner;
use super::report::{Beginning, Line};
use super::robot::Robot;
use super::stray::Stray;
use super::summary::Summary;
use super::{explore, guide, robot};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::Serving;
use mrol::server::shutdown_signal;
use mrol_client::{Client, NewMap};
use mrol_map::map::{LEVELS_DEFAULT, MapName};
use mrol_service::MapInfo;
use mrol_simulate::{Scene, tours};

/// Answers that are buffered before the printer.
const NEWS_AHEAD: usize = 16;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol demo              then look around with the commands that it prints; Ctrl-C ends it
  mrol demo --once       end when the robots are done: exit code 0 if all is as it should be
  mrol demo --seed 7     other furniture, other noise
  mrol demo --explore --once --picture explored.svg
                         a robot explores the building by itself";

/// See it work: two simulated robots build one map in the real daemon, a planner asks about it
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Demo {
    /// End when the robots are done
    #[arg(long)]
    once: bool,
    /// Seed of furniture and noise: the same seed gives the same scene and the same scans
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Scans of each robot
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u16).range(2..=500))]
    scans: u16,
    /// Side of a finest voxel, meters [default: 0.03, or 0.05 with --explore]
    #[arg(long, value_name = "METERS")]
    resolution: Option<f64>,
    /// Instead, one robot that nobody steers maps the building: always to the nearest frontier
    #[arg(long)]
    explore: bool,
    /// Draw what the explorer mapped, what it left and its path as an SVG file
    #[arg(long, value_name = "FILE", requires = "explore")]
    picture: Option<PathBuf>,
    /// Levels of the map
    #[arg(long, default_value_t = LEVELS_DEFAULT)]
    levels: u32,
    /// Address of HTTP [default: 127.0.0.1:7333, or any free port where that is taken]
    #[arg(long, value_name = "ADDRESS")]
    http_listen: Option<SocketAddr>,
    /// Address of gRPC [default: 127.0.0.1:7334, or any free port where that is taken]
    #[arg(long, value_name = "ADDRESS")]
    grpc_listen: Option<SocketAddr>,
}

/// What was shown.
enum Shown {
    /// Two robots built a map.
    Built(Checks),
    /// A robot explored.
    Explored(explore::Explored),
}

impl Shown {
    /// An error where something was not as it should be.
    fn verdict(&self) -> Result<(), CliError> {
        match self {
            Self::Built(checks) => checks.verdict(),
            Self::Explored(explored) => explored.verdict(),
        }
    }
}

impl Demo {
    pub(crate) async fn run(self, output: Output) -> Result<(), CliError> {
        let mut interrupt = pin!(shutdown_signal());
        let daemon = Daemon::start(self.http_listen, self.grpc_listen, &output).await?;
        let shown = tokio::select! {
            shown = self.show(daemon.serving(), &output) => shown.and_then(|shown| shown.verdict()),
            () = &mut interrupt => Err(CliError::failed("interrupted before the robots were done")),
        };
        if !self.once && shown.is_ok() {
            output.say("\nThe daemon stays up: Ctrl-C ends it.")?;
            interrupt.await;
        }
        daemon.stop().await?;
        shown
    }

    async fn show(&self, serving: Serving, output: &Output) -> Result<Shown, CliError> {
        let map = MapName::new(guide::MAP).map_err(CliError::failed)?;
        let operator = Client::connect(&serving.grpc.to_string()).await?;
        let resolution_m = self.resolution.unwrap_or(if self.explore { 0.05 } else { 0.03 });
        let new_map = NewMap { levels: Some(self.levels), ..NewMap::of(resolution_m) };
        let (info, _) = operator.create_map(&map, new_map).await?;
        output.say(format!("See the map grow in a browser: {}\n", guide::page(&serving)))?;
        if !self.explore {
            return Ok(Shown::Built(self.show_building(serving, &operator, &info, output).await?));
        }
        let explored = explore::explore(&operator, &info, self.seed, self.picture.as_deref(), output).await?;
        output.print(&explored)?;
        Ok(Shown::Explored(explored))
    }

    /// Runs the demonstration; returns the checks of its results.
    async fn show_building(
        &self,
        serving: Serving,
        operator: &Client,
        info: &MapInfo,
        output: &Output,
    ) -> Result<Checks, CliError> {
        let map = info.name.clone();
        let robots = self.robots();
        output.print(&Beginning::new(serving, info, self.seed, &robots))?;
        output.say(Line::head())?;

        let start = Instant::now();
        let planner = Planner::start(&serving, &map, self.seed).await?;
        let mut journal = Journal::new(start, planner.tally());
        self.run_robots(robots, &serving, &map, |news| output.print(&journal.enter(news))).await?;
        let queries = planner.stop().await?;

        let stray = Stray::send(operator, &map).await?;
        let info = operator.map_info(&map).await?;
        let checks = Checks::of(&journal, &queries, &info, &stray);
        output.print(&Summary::new(&journal, &queries, &info, &checks))?;
        output.say(guide::text(&serving, self.once))?;
        Ok(checks)
    }

    fn robots(&self) -> Vec<Robot> {
        let scene = Arc::new(Scene::furnished(self.seed));
        let tours = tours(usize::from(self.scans)).into_iter();
        tours.zip(0..).map(|(tour, stream)| Robot::new(tour, Arc::clone(&scene), self.seed, stream)).collect()
    }

    /// Starts all robots at once, and prints each scan when it is answered.
    async fn run_robots(
        &self,
        robots: Vec<Robot>,
        serving: &Serving,
        map: &MapName,
        mut tell: impl FnMut(robot::News) -> Result<(), CliError>,
    ) -> Result<(), CliError> {
        let (sender, mut news) = mpsc::channel(NEWS_AHEAD);
        // The robots are dropped with this future.
        let mut on_tour = JoinSet::new();
        for robot in robots {
            let client = Client::connect(&serving.grpc.to_string()).await?;
            on_tour.spawn(robot.tour(client, map.clone(), sender.clone()));
        }
        drop(sender);
        while let Some(news) = news.recv().await {
            tell(news)?;
        }
        while let Some(ended) = on_tour.join_next().await {
            ended.map_err(CliError::failed)??;
        }
        Ok(())
    }
}
