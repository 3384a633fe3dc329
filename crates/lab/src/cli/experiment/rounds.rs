//! `mrol-lab experiment rounds`: shows that viewpoints grow with the space that a robot sees, not with time.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::cli::bench::workload::MapOptions;
use crate::experiment::rounds::{Round, SCANS_PER_S, drive};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_map::map::{MultiResolutionMap, RobotName};
use mrol_simulate::SpinningLidar;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment rounds                 an hour: 49 rounds of 44 m through the building of the demonstration
  mrol-lab experiment rounds --minutes 5

A simulated robot drives the same way at 0.6 m/s and sends 10 scans a second, which are aligned from the last pose. A line a
round; the last one is not whole.";

/// What a map keeps of a robot that drives the same way for an hour
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Rounds {
    /// Time that is simulated, minutes
    #[arg(long, value_name = "MINUTES", default_value_t = 60, value_parser = clap::value_parser!(u16).range(1..=1440))]
    minutes: u16,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// Seed of furniture and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl Rounds {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let map = MultiResolutionMap::new(self.map.settings(self.resolution)?).map_err(CliError::usage)?;
        let robot = RobotName::new("experiment").map_err(CliError::failed)?;
        let scans = (f64::from(self.minutes) * 60.0 * SCANS_PER_S) as usize;
        output.say(Line::HEAD)?;
        let (mut rounds, mut printed) = (0, Ok(()));
        let told = |kept: Round| {
            rounds += 1;
            if printed.is_ok() {
                printed = output.print(&Line::of(rounds, &kept));
            }
        };
        drive(&map, &robot, &SpinningLidar::default(), scans, self.seed, told).map_err(CliError::failed)?;
        printed
    }
}

/// What the map keeps after a round.
#[derive(Debug, Serialize)]
struct Line {
    round: usize,
    accepted: usize,
    refused: usize,
    viewpoints: usize,
    viewpoint_bytes: usize,
    voxels: usize,
}

impl Line {
    const HEAD: &'static str = "round  accepted  refused  viewpoints  their bytes     voxels";

    fn of(round: usize, kept: &Round) -> Self {
        let Round { accepted, refused, viewpoints, viewpoint_bytes, voxels } = *kept;
        Self { round, accepted, refused, viewpoints, viewpoint_bytes, voxels }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [bytes, voxels] = [self.viewpoint_bytes, self.voxels].map(count);
        let Self { round, accepted, refused, viewpoints, .. } = self;
        write!(f, "{round:>5}  {accepted:>8}  {refused:>7}  {viewpoints:>10}  {bytes:>11}  {voxels:>9}")
    }
}
