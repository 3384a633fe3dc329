//! `mrol-lab bench rays`: times rays through a map.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use super::workload::{MapOptions, ShotOptions, WorkloadOptions, size_of, times};
use crate::measure::peer_file;
use crate::measure::rays::{Cast, cast};
use crate::workload::Shots;
use mrol::console::error::CliError;
use mrol::console::map_report::{count, percent};
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench rays                                                  a panorama of 2000 x 500 rays in the room
  mrol-lab bench rays --workload site --places 64 --azimuths 80 --rings 20
  mrol-lab bench rays --peer-file rays.bin && crates/lab/benches/peers/octomap rays.bin

Rays go from places on the sensor's path: in the room in all directions, on the site in those that its sensor looks in.
One core, through the map's locks, from origins and directions to distances and voxels; ns_per_ray is the median of
--repeats passes after one that is not timed. --peer-file writes voxels, rays and distances for other libraries.";

/// Time rays: which voxel each meets first, and how far away
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Rays {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    shots: ShotOptions,
    /// Length of a ray, meters
    #[arg(long, value_name = "METERS", default_value_t = 100.0)]
    range: f64,
    /// Level to ask: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Passes over all rays
    #[arg(long, value_name = "N", default_value = "11", value_parser = times)]
    repeats: usize,
    /// Write voxels, rays and distances to this file
    #[arg(long, value_name = "FILE")]
    peer_file: Option<PathBuf>,
}

impl Rays {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let map = self.map.map_of(self.workload.workload())?;
        self.map.check_level(self.level)?;
        let shots = self.shots.of(&self.workload);
        let (size, passes) = (size_of(&map, self.level), self.repeats);
        output.say(format!("{size}, {} rays, median of {passes} passes", count(shots.origins.len())))?;
        output.say(Line::HEAD)?;
        let cast = cast(&map, &shots, self.range, self.level, passes).map_err(CliError::usage)?;
        output.print(&Line::of(&cast))?;
        match &self.peer_file {
            Some(path) => {
                peer_file::write(path, &map, self.range, queries(&shots, &cast)).map_err(CliError::failed)
            }
            None => Ok(()),
        }
    }
}

fn queries(shots: &Shots, cast: &Cast) -> impl ExactSizeIterator<Item = ([f32; 6], f32)> {
    (0..shots.origins.len()).map(|ray| {
        let ([x, y, z], [dx, dy, dz]) = (shots.origins[ray].xyz(), shots.directions[ray].xyz());
        ([x, y, z, dx, dy, dz], cast.hits.distances_m[ray])
    })
}

/// The result.
#[derive(Serialize)]
struct Line {
    ns_per_ray: f64,
    rays_per_s: f64,
    rays: usize,
    hits: usize,
    mean_distance_m: f64,
}

impl Line {
    const HEAD: &str = "ns a ray  M rays/s        hits  of rays  mean distance";

    fn of(cast: &Cast) -> Self {
        let ns_per_ray = cast.runs.median();
        Self {
            ns_per_ray,
            rays_per_s: 1e9 / ns_per_ray,
            rays: cast.hits.len(),
            hits: cast.hits.hits(),
            mean_distance_m: cast.mean_distance_m(),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:>8.1} {:>9.2} {:>11} {:>8} {:>12.2} m",
            self.ns_per_ray,
            self.rays_per_s / 1e6,
            count(self.hits),
            percent(self.hits as f64 / self.rays.max(1) as f64),
            self.mean_distance_m
        )
    }
}
