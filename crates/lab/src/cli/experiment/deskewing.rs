//! `mrol-lab experiment deskewing`: compares poses of a lidar that moves while it turns with those of one that stands.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use crate::experiment::deskewing::{GuessFrom, PoseError, Sweep, errors};
use crate::report::{Table, folder};
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol_map::map::{LEVELS_DEFAULT, MapSettings, MultiResolutionMap, RobotName};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment deskewing --out results/
  mrol-lab experiment deskewing --out results/ --scans 40 --seed 2 --json

A simulated lidar (32 rings, 10 turns a second, noise of 1 cm) drives circles in a hall at 2 m/s and 1 rad/s, after two
seconds of getting up to speed. Its scans are taken standing, moving and deskewed, and moving as they come; the guess is odometry that is 2 %
off, or the velocity of the last two poses. Errors are against the true poses, of the scans that were accepted. Writes
deskewing.csv and deskewing.md.";

/// Poses of a lidar that moves while it turns: deskewed, not deskewed, and standing
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Deskewing {
    /// Where to write the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Scans of each ride
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(2..=2000))]
    scans: u16,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.1)]
    resolution: f64,
    /// Seed of the hall and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Deskewing {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        folder(&self.out)?;
        output.say(Line::HEAD)?;
        let robot = RobotName::new("lidar").map_err(CliError::failed)?;
        let head = ["sensor", "guess", "scan", "error_m", "error_deg"];
        let (mut scans, mut summary) = (Table::new(head), Table::new(Line::HEAD.split_whitespace()));
        for guess in [GuessFrom::Odometry, GuessFrom::ConstantVelocity] {
            for sweep in [Sweep::Standing, Sweep::Deskewed, Sweep::Raw] {
                let settings = MapSettings::new(self.resolution, LEVELS_DEFAULT);
                let map = MultiResolutionMap::new(settings).map_err(CliError::usage)?;
                let errors = errors(sweep, guess, self.scans.into(), &map, &robot, self.seed);
                let errors = errors.map_err(CliError::failed)?;
                let line = Line::of(sweep, guess, &errors);
                for (k, error) in (1..).zip(&errors) {
                    let cell = |of: fn(&PoseError) -> f64| {
                        error.as_ref().map_or("refused".into(), |error| format!("{:.5}", of(error)))
                    };
                    let (meters, degrees) = (cell(|error| error.meters), cell(|error| error.degrees));
                    scans.push([
                        line.sensor.to_owned(),
                        line.guess.to_owned(),
                        format!("{k}"),
                        meters,
                        degrees,
                    ]);
                }
                summary.push(line.to_string().split_whitespace());
                output.print(&line)?;
            }
        }
        scans.write_csv(&self.out.join("deskewing.csv"))?;
        Ok(summary.write_markdown(&self.out.join("deskewing.md"))?)
    }
}

/// One ride.
#[derive(Debug, Serialize)]
struct Line {
    sensor: &'static str,
    guess: &'static str,
    scans: usize,
    accepted: usize,
    median_m: f64,
    p95_m: f64,
    median_deg: f64,
    p95_deg: f64,
}

impl Line {
    const HEAD: &str = "sensor    guess              scans  accepted  median_mm  p95_mm  median_deg  p95_deg";

    fn of(sweep: Sweep, guess: GuessFrom, errors: &[Option<PoseError>]) -> Self {
        let accepted: Vec<&PoseError> = errors.iter().flatten().collect();
        let quantile = |of: fn(&PoseError) -> f64, share: f64| {
            let mut sorted: Vec<f64> = accepted.iter().map(|error| of(error)).collect();
            sorted.sort_unstable_by(f64::total_cmp);
            let at = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
            sorted.get(at).copied().unwrap_or(f64::NAN)
        };
        Self {
            sensor: match sweep {
                Sweep::Standing => "standing",
                Sweep::Deskewed => "deskewed",
                Sweep::Raw => "raw",
            },
            guess: match guess {
                GuessFrom::Odometry => "odometry",
                GuessFrom::ConstantVelocity => "constant-velocity",
            },
            scans: errors.len(),
            accepted: accepted.len(),
            median_m: quantile(|error| error.meters, 0.5),
            p95_m: quantile(|error| error.meters, 0.95),
            median_deg: quantile(|error| error.degrees, 0.5),
            p95_deg: quantile(|error| error.degrees, 0.95),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sensor, guess, scans, accepted, median_m, p95_m, median_deg, p95_deg } = self;
        let (median_mm, p95_mm) = (median_m * 1e3, p95_m * 1e3);
        write!(
            f,
            "{sensor:<9} {guess:<17} {scans:>6} {accepted:>9} {median_mm:>10.2} {p95_mm:>7.2} {median_deg:>11.3} {p95_deg:>8.3}"
        )
    }
}
