//! `mrol-lab bench memory`: what a map takes, with all that it may keep and without.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions};
use crate::cli::sequence;
use crate::measure::memory::{Parts, of_scans, of_workload};
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_map::map::MapSettings;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench memory                                               a room
  mrol-lab bench memory --workload site                               ten million voxels
  mrol-lab bench memory scans/ --truth poses.txt --resolution 0.1     scans at their true poses

Bytes a finest voxel, as the map counts them: the exact set of all levels in two parts (masks of 8 x 8 x 8 voxels, and
the tables that lead to them, which have room to grow), the filters of all levels with their counters, and the moments
of the points. A workload's points are the centers of its voxels. The trajectory is left out.";

/// Scans of a file set, at most.
const SCANS_MAX: usize = 1000;

/// Measure the memory that a map takes, as it is made usually, without one part, and for queries only
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Memory {
    /// Scan files, or folders of them: .ply .pcd .xyz .npy .bin .f32 .3d [default: the workload]
    #[arg(value_name = "DIR_OR_FILES", requires = "truth")]
    scans: Vec<PathBuf>,
    /// Side of a finest voxel of a map of scans, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// True poses of the scans, a TUM file
    #[arg(long, value_name = "FILE", requires = "scans")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
}

impl Memory {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let scans = self.scans(output)?;
        let workload = self.workload.workload();
        let resolution_m = if scans.is_empty() { workload.resolution_m() } else { self.resolution };
        let whole = self.map.settings(resolution_m)?;
        output.say(Line::HEAD)?;
        for (keeps, settings) in [
            ("all", whole),
            ("no moments", MapSettings { moments: false, ..whole }),
            ("no filter", MapSettings { filter: None, ..whole }),
            ("query only", MapSettings { filter: None, moments: false, ..whole }),
        ] {
            let parts = match scans.is_empty() {
                true => of_workload(workload, settings),
                false => of_scans(&scans, settings),
            };
            output.print(&Line::of(keeps, &parts.map_err(CliError::usage)?))?;
        }
        Ok(())
    }

    fn scans(&self, output: &Output) -> Result<Vec<Scan>, CliError> {
        match self.scans.is_empty() {
            true => Ok(Vec::new()),
            false => sequence::read(&self.scans, self.truth.as_deref(), SCANS_MAX, output),
        }
    }
}

/// The memory of one map, bytes a finest voxel.
#[derive(Serialize)]
struct Line {
    keeps: &'static str,
    voxels: usize,
    bytes: usize,
    masks_per_voxel: f64,
    tables_per_voxel: f64,
    filters_per_voxel: f64,
    moments_per_voxel: f64,
    bytes_per_voxel: f64,
}

impl Line {
    const HEAD: &str = "map             voxels  bytes a voxel: set masks   tables  filters  moments      all";

    fn of(keeps: &'static str, parts: &Parts) -> Self {
        let per_voxel = |bytes: usize| bytes as f64 / parts.voxels.max(1) as f64;
        Self {
            keeps,
            voxels: parts.voxels,
            bytes: parts.total(),
            masks_per_voxel: per_voxel(parts.masks),
            tables_per_voxel: per_voxel(parts.tables),
            filters_per_voxel: per_voxel(parts.filters),
            moments_per_voxel: per_voxel(parts.moments),
            bytes_per_voxel: per_voxel(parts.total()),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<10} {:>11} {:>25.2} {:>8.2} {:>8.2} {:>8.2} {:>8.2}",
            self.keeps,
            count(self.voxels),
            self.masks_per_voxel,
            self.tables_per_voxel,
            self.filters_per_voxel,
            self.moments_per_voxel,
            self.bytes_per_voxel
        )
    }
}
