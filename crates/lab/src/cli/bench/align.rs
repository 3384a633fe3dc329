//! `mrol-lab bench align`: times alignments.

use mrol_map::util::Keyword;
use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use super::workload::{MapOptions, times};
use crate::cli::sequence;
use crate::measure::align::{Aligned, align_each};
use crate::workload::{self, Scan};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol::console::statistics::Statistics;
use mrol_map::align::Method;
use mrol_map::map::{Lookup, RobotName};
use mrol_simulate::tours;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench align                                                simulated scans of a lidar
  mrol-lab bench align scans/ --resolution 0.05 --levels 5
  mrol-lab bench align scans/ --resolution 0.1 --truth poses.txt --json

Each scan but the first is aligned to the map of those before it, from the pose of the scan before: refined and by
overlap alone, by the Bloom filters and by the exact sets; all get the same map. Of --repeats alignments of a scan the quickest
counts. Errors are those against the true poses, where these are known; the map is then made at them.";

/// Time alignments, by method, by the Bloom filters and by the exact sets
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Align {
    /// Scan files, or folders of them: .ply .pcd .xyz .npy .bin .f32 .3d [default: simulated scans]
    #[arg(value_name = "DIR_OR_FILES")]
    scans: Vec<PathBuf>,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// True poses of the scans, a TUM file
    #[arg(long, value_name = "FILE", requires = "scans")]
    truth: Option<PathBuf>,
    /// Largest number of scans
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(2..=1000))]
    scans_max: u16,
    /// Seed of the simulation
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
    /// Alignments of each scan
    #[arg(long, value_name = "N", default_value = "3", value_parser = times)]
    repeats: usize,
}

impl Align {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let settings = self.map.settings(self.resolution)?;
        let scans = self.scans(output)?;
        if scans.len() < 2 {
            return Err(CliError::failed(
                "at least two scans are needed: the second is aligned to the first",
            ));
        }
        let points = scans.iter().map(|scan| scan.points.len()).sum::<usize>() / scans.len();
        let (scans_aligned, points) = (scans.len() - 1, count(points));
        output.say(format!("{scans_aligned} scans of {points} points each, about"))?;
        output.say(Line::HEAD)?;
        let ways = [Method::Refined, Method::Overlap]
            .map(|method| [Lookup::Bloom, Lookup::Exact].map(|lookup| (method, lookup)));
        let robot = RobotName::new("bench").map_err(CliError::failed)?;
        let aligned = align_each(&scans, &robot, settings, ways.as_flattened(), self.repeats)
            .map_err(CliError::usage)?;
        aligned.iter().try_for_each(|aligned| output.print(&Line::of(aligned)))
    }

    fn scans(&self, output: &Output) -> Result<Vec<Scan>, CliError> {
        let scans_max = self.scans_max.into();
        if self.scans.is_empty() {
            let [lidar, _] = tours(scans_max);
            return Ok(workload::simulate(&lidar, self.seed));
        }
        sequence::read(&self.scans, self.truth.as_deref(), scans_max, output)
    }
}

/// The result of one method.
#[derive(Serialize)]
struct Line {
    method: &'static str,
    lookup: &'static str,
    scans: usize,
    ms_median: f64,
    ms_max: f64,
    lookups: u64,
    ns_per_lookup: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_m: Option<Statistics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_deg: Option<Statistics>,
}

impl Line {
    const HEAD: &str = "method   look-ups  ms median     max        look-ups  ns a look-up  median error";

    fn of(aligned: &Aligned) -> Self {
        let ms = Statistics::of(aligned.ms.clone());
        let of_errors =
            |pick: fn(&(f64, f64)) -> f64| Statistics::of(aligned.errors.iter().map(pick).collect());
        Self {
            method: aligned.method.as_str(),
            lookup: aligned.lookup.as_str(),
            scans: aligned.ms.len(),
            ms_median: ms.map_or(0.0, |ms| ms.median),
            ms_max: ms.map_or(0.0, |ms| ms.max),
            lookups: aligned.lookups,
            ns_per_lookup: aligned.ms.iter().sum::<f64>() * 1e6 / aligned.lookups.max(1) as f64,
            error_m: of_errors(|error| error.0),
            error_deg: of_errors(|error| error.1),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, lookup, ms_median, ms_max, ns_per_lookup, .. } = self;
        let lookups = count(self.lookups as usize);
        write!(
            f,
            "{method:<8} {lookup:<8} {ms_median:>10.2} {ms_max:>7.2} {lookups:>15} {ns_per_lookup:>13.2}"
        )?;
        match (&self.error_m, &self.error_deg) {
            (Some(meters), Some(degrees)) => {
                write!(f, "  {:.1} mm {:.3} deg", meters.median * 1e3, degrees.median)
            }
            _ => Ok(()),
        }
    }
}
