//! `mrol-lab bench planning`: times planners' questions.

use std::fmt::{self, Display};
use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, size_of, times};
use crate::measure::planning::{
    ArmPoses, Changing, Motions, PointBody, arm_poses, between_insertions, motions, point_body, write_arms,
};
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count, percent};
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench planning                                 an arm, a body of points and motions in a room
  mrol-lab bench planning --workload site                 the same on ten million voxels
  mrol-lab bench planning --scans 0 --json                without the part in which the map changes
  mrol-lab bench planning --peer-file arms.bin && crates/lab/benches/peers/coal_octree.py arms.bin

On one core, in this process. An arm of 59 spheres stands at random places within 1 m of a surface, with random joint
angles: its hand and fingers are links, and then parts of the last link. The body of points is asked where it meets nothing.
Half of the motions of 0.5 m, of a body of 20 spheres, collide. Then scans of 20,000 points go in ten times a second while the
arm is asked about. Figures are medians of --repeats passes. --peer-file is for other libraries.";

/// Time planners' questions: an arm at poses, a body of points, motions; between insertions as well
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Planning {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Poses of the arm
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    poses: u32,
    /// Poses of the body of points
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    point_poses: u32,
    /// Scans that go in while the arm is asked about
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    scans: u32,
    /// Passes over all poses
    #[arg(long, value_name = "N", default_value = "11", value_parser = times)]
    repeats: usize,
    /// Write voxels, the arm's spheres and the answers to this file
    #[arg(long, value_name = "FILE")]
    peer_file: Option<PathBuf>,
}

impl Planning {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let (workload, seed) = (self.workload.workload(), self.workload.seed());
        let map = Arc::new(self.map.map_of(workload)?);
        output.say(format!("{}: {}, median of {} passes", self.workload, size_of(&map, 0), self.repeats))?;
        let voxels = map.voxels(0);
        for has_stiff_hand in [false, true] {
            let arm = arm_poses(&map, has_stiff_hand, self.poses as usize, self.repeats, seed);
            output.print(&ArmLine::of(&arm.map_err(CliError::usage)?, voxels))?;
        }
        let points =
            point_body(&map, self.point_poses as usize, self.repeats, seed).map_err(CliError::usage)?;
        output.print(&PointsLine::of(&points))?;
        let motions = motions(&map, self.repeats, seed).map_err(CliError::usage)?;
        output.print(&MotionsLine::of(&motions))?;
        if let Some(path) = &self.peer_file {
            write_arms(path, &map, self.poses as usize, seed).map_err(CliError::failed)?;
        }
        drop(map);
        if self.scans > 0 {
            let settings = self.map.settings(workload.resolution_m())?;
            let changing = between_insertions(workload, settings, self.scans as usize, seed);
            output.print(&ChangingLine::of(&changing.map_err(|e| CliError::usage(e.to_string()))?))?;
        }
        Ok(())
    }
}

#[derive(Serialize)]
struct ArmLine {
    what: &'static str,
    links: usize,
    ns_per_pose: f64,
    first_pass_ns_per_pose: f64,
    poses: usize,
    colliding: usize,
    field_bytes: usize,
    field_bytes_per_voxel: f64,
}

impl ArmLine {
    fn of(arm: &ArmPoses, voxels: usize) -> Self {
        Self {
            what: "arm",
            links: arm.links,
            ns_per_pose: arm.runs.median(),
            first_pass_ns_per_pose: arm.first_ns,
            poses: arm.poses,
            colliding: arm.colliding,
            field_bytes: arm.field_bytes,
            field_bytes_per_voxel: arm.field_bytes as f64 / voxels.max(1) as f64,
        }
    }
}

impl Display for ArmLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = percent(self.colliding as f64 / self.poses.max(1) as f64);
        write!(
            f,
            "arm of 59 spheres, {} links: {:.0} ns a pose ({} poses, {share} collide), {:.0} ns in the first pass; fields of {}, {:.1} bytes a voxel",
            self.links,
            self.ns_per_pose,
            count(self.poses),
            self.first_pass_ns_per_pose,
            bytes(self.field_bytes),
            self.field_bytes_per_voxel
        )
    }
}

#[derive(Serialize)]
struct PointsLine {
    what: &'static str,
    ns_per_pose: f64,
    bloom_ns_per_pose: f64,
    times_as_fast: f64,
    poses: usize,
    points: usize,
}

impl PointsLine {
    fn of(measured: &PointBody) -> Self {
        let (body, bloom) = (measured.body.median(), measured.bloom.median());
        Self {
            what: "points",
            ns_per_pose: body,
            bloom_ns_per_pose: bloom,
            times_as_fast: bloom / body.max(1e-9),
            poses: measured.poses,
            points: measured.points,
        }
    }
}

impl Display for PointsLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "body of {} points, free: {:.0} ns a pose ({} poses), {:.2} times as fast as the filter, which takes {:.0} ns",
            self.points,
            self.ns_per_pose,
            count(self.poses),
            self.times_as_fast,
            self.bloom_ns_per_pose
        )
    }
}

#[derive(Serialize)]
struct MotionsLine {
    what: &'static str,
    us_per_motion: f64,
    motions: usize,
    colliding: usize,
}

impl MotionsLine {
    fn of(measured: &Motions) -> Self {
        let us_per_motion = measured.runs.median() / 1e3;
        Self { what: "motions", us_per_motion, motions: measured.motions, colliding: measured.colliding }
    }
}

impl Display for MotionsLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "motions of 0.5 m, 20 spheres: {:.2} us a motion ({} motions, {} collide)",
            self.us_per_motion, self.motions, self.colliding
        )
    }
}

#[derive(Serialize)]
struct ChangingLine {
    what: &'static str,
    steady_ns_per_pose: f64,
    between_insertions_ns_per_pose: f64,
    first_check_ms_median: f64,
    first_check_ms_p99: f64,
    insertion_ms_without: f64,
    insertion_ms_with: f64,
    new_voxels_per_scan: f64,
}

impl ChangingLine {
    fn of(changing: &Changing) -> Self {
        let at = |times: &[f64], share: f64| {
            times.get((share * times.len().saturating_sub(1) as f64).round() as usize).copied().unwrap_or(0.0)
        };
        Self {
            what: "changing",
            steady_ns_per_pose: changing.steady_ns,
            between_insertions_ns_per_pose: changing.between_ns,
            first_check_ms_median: at(&changing.first_checks_ms, 0.5),
            first_check_ms_p99: at(&changing.first_checks_ms, 0.99),
            insertion_ms_without: at(&changing.without_planner_ms, 0.5),
            insertion_ms_with: at(&changing.with_planner_ms, 0.5),
            new_voxels_per_scan: changing.changed_voxels,
        }
    }
}

impl Display for ChangingLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { steady_ns_per_pose: steady, between_insertions_ns_per_pose: between, .. } = self;
        writeln!(
            f,
            "ten insertions a second of {:.0} new voxels: {between:.0} ns a pose, {:.2} times {steady:.0} ns",
            self.new_voxels_per_scan,
            between / steady.max(1e-9)
        )?;
        writeln!(
            f,
            "first 100 poses after one: median {:.2} ms, p99 {:.2} ms",
            self.first_check_ms_median, self.first_check_ms_p99
        )?;
        write!(
            f,
            "an insertion: median {:.2} ms with the planner, {:.2} ms without",
            self.insertion_ms_with, self.insertion_ms_without
        )
    }
}
