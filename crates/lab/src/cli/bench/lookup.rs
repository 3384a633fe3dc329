//! `mrol-lab bench lookup`: times the map's look-ups and those of other structures.

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, size_of, times};
use crate::measure::lookup::{Measured, compare};
use crate::rivals::{Structure, StructureName};
use crate::workload::{Queries, add};
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count, percent};
use mrol::console::output::Output;
use mrol::console::parse;
use mrol::console::points_of;
use mrol_map::geometry::Pose;
use mrol_map::map::MultiResolutionMap;
use mrol_map::voxel::VoxelSet;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench lookup --structures bloom,exact,hashset,dense,paper --json
  mrol-lab bench lookup --workload site --order scan --filter-bits-per-key 27
  mrol-lab bench lookup --voxels map.ply --points scan.f32 --resolution 0.05 --json
  mrol-lab bench lookup --voxels map.ply --points scan.ply --resolution 0.05 --pose \"1 2 0 0 0 0 1\" --level 1

Each structure is asked which of the same points are in occupied voxels, from points in a sensor's frame and its
pose to a bit a point, on one core. bloom and exact are this map as its users ask it, ten thousand points at a
time through its locks; bloom-kernel and exact-kernel the same without locks. The others get the same transform,
and one level without locks. ns_per_point is the median of --repeats passes, each after one that is not timed;
structures take turns.
bytes are those of the level: a filter's plane and counters, for exact the set of all levels.

Answers are checked before the clock runs: none may deny an occupied voxel, exact ones may not invent one.";

/// Time look-ups: this map against a hash set, a dense array and the paper's own filter
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Lookup {
    /// Make the map of the points in this file: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(long, value_name = "FILE", requires_all = ["points", "resolution"], conflicts_with = "workload")]
    voxels: Option<PathBuf>,
    /// Ask about the points in this file
    #[arg(long, value_name = "FILE", requires = "voxels")]
    points: Option<PathBuf>,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", requires = "voxels")]
    resolution: Option<f64>,
    /// Where the frame of --points lies in the map: "x y z qx qy qz qw" [default: the map's own frame]
    #[arg(long, value_name = "POSE", requires = "voxels", allow_hyphen_values = true, value_parser = parse::pose)]
    pose: Option<Pose>,
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Structures to time, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["bloom", "exact", "hashset", "dense", "paper"])]
    structures: Vec<StructureName>,
    /// Level to ask: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Passes over all points
    #[arg(long, value_name = "N", default_value = "11", value_parser = times)]
    repeats: usize,
}

impl Lookup {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let (map, queries) = self.map_and_queries(output)?;
        self.map.check_level(self.level)?;
        let structures = self.build(&map, output);
        let (what, points) = (self.what(), count(queries.points.len()));
        output.say(format!(
            "{what}: {}, {points} points, median of {} passes",
            size_of(&map, self.level),
            self.repeats
        ))?;
        output.say(Line::HEAD)?;
        let measured =
            compare(&structures, &map, self.level, &queries, self.repeats).map_err(CliError::failed)?;
        measured.iter().try_for_each(|measured| output.print(&Line::of(measured)))
    }

    fn what(&self) -> String {
        match &self.voxels {
            Some(path) => path.display().to_string(),
            None => self.workload.to_string(),
        }
    }

    fn map_and_queries(&self, output: &Output) -> Result<(MultiResolutionMap, Queries), CliError> {
        match (&self.voxels, &self.points, self.resolution) {
            (Some(voxels), Some(points), Some(resolution_m)) => {
                let map = self.map_of_file(voxels, resolution_m, output)?;
                let map_from_points = self.pose.unwrap_or_else(Pose::identity);
                Ok((map, Queries { points: points_of(points)?, map_from_points }))
            }
            _ => Ok((self.map.map_of(self.workload.workload())?, self.workload.queries(1))),
        }
    }

    fn map_of_file(
        &self,
        path: &Path,
        resolution_m: f64,
        output: &Output,
    ) -> Result<MultiResolutionMap, CliError> {
        let map = MultiResolutionMap::new(self.map.settings(resolution_m)?).map_err(CliError::usage)?;
        let (voxels, skipped) = VoxelSet::of_points(&points_of(path)?, &map.lattice().from_map());
        if skipped > 0 {
            let file = path.display();
            output.note(format!("{file}: {} points in no voxel are left out", count(skipped)));
        }
        add(&map, voxels);
        Ok(map)
    }

    fn build<'a>(
        &self,
        map: &'a MultiResolutionMap,
        output: &Output,
    ) -> Vec<(StructureName, Box<dyn Structure + 'a>)> {
        let build = |&name: &StructureName| match name.build(map, self.level) {
            Ok(structure) => Some((name, structure)),
            Err(too_large) => {
                output.note(format!("{name} is left out: {too_large}"));
                None
            }
        };
        self.structures.iter().filter_map(build).collect()
    }
}

/// The result of one structure.
#[derive(Serialize)]
struct Line {
    structure: &'static str,
    ns_per_point: f64,
    points: usize,
    occupied: usize,
    false_positives: usize,
    bytes: usize,
}

impl Line {
    const HEAD: &str = "structure      ns a point      occupied  false positives  of absent         bytes";

    fn of(measured: &Measured) -> Self {
        Self {
            structure: measured.name.as_str(),
            ns_per_point: measured.runs.median(),
            points: measured.points,
            occupied: measured.occupied,
            false_positives: measured.false_positives,
            bytes: measured.bytes,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let absent = self.points - (self.occupied - self.false_positives);
        let rate = percent(self.false_positives as f64 / absent.max(1) as f64);
        write!(
            f,
            "{:<14} {:>10.2} {:>13} {:>16} {rate:>10} {:>13}",
            self.structure,
            self.ns_per_point,
            count(self.occupied),
            count(self.false_positives),
            bytes(self.bytes)
        )
    }
}
