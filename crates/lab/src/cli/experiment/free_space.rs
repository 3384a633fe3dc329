//! `mrol-lab experiment free-space`: measures how much of what another library calls free is known to be free here.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use crate::cli::bench::workload::MapOptions;
use crate::cli::sequence;
use crate::experiment::free_space::{PeerStates, States, map_at_poses, speeds, write_scans};
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::map_report::{count, percent};
use mrol::console::output::Output;
use mrol_map::geometry::Pose;
use mrol_map::map::{MultiResolutionMap, RobotName};
use mrol_map::mapping::{MappingSettings, ViewpointSettings};
use mrol_map::visibility::SensorModel;
use mrol_map::voxel::VoxelKey;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment free-space hall/ --truth hall/poses.txt --resolution 0.1 --peer-scans scans.bin
  octomap_free_space scans.bin states.bin
  mrol-lab experiment free-space hall/ --truth hall/poses.txt --resolution 0.1 --peer-states states.bin

The scans are mapped at their true poses; those that see something new leave viewpoints. The peer, crates/lab/benches/peers/octomap_free_space.cpp,
takes the same scans, poses and range. Of the voxels that it calls free, those in which a point of a scan fell are left out; what
is unknown here counts as wrong.";

/// What is known to be free, against the voxels that OctoMap calls free and occupied from the same scans
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FreeSpace {
    /// Scan files, or folders of them: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(required = true, value_name = "DIR_OR_FILES")]
    scans: Vec<PathBuf>,
    /// True poses of the scans, a TUM file
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// Up to where scans are believed to see, meters
    #[arg(long, value_name = "METERS", default_value_t = 20.0)]
    range: f64,
    /// How the rays of the sensor lie: "spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG" or "pinhole WIDTH HEIGHT FX FY"
    #[arg(long, value_name = "MODEL")]
    sensor: Option<SensorModel>,
    /// Largest number of scans
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    scans_max: u16,
    /// Write the scans for a peer
    #[arg(long, value_name = "FILE")]
    peer_scans: Option<PathBuf>,
    /// What the peer says of the voxels
    #[arg(long, value_name = "FILE")]
    peer_states: Option<PathBuf>,
    #[command(flatten)]
    map: MapOptions,
}

impl FreeSpace {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let scans = sequence::read(&self.scans, Some(&self.truth), self.scans_max.into(), output)?;
        let at_poses: Vec<(&Scan, Pose)> =
            scans.iter().filter_map(|scan| Some((scan, scan.map_from_sensor?))).collect();
        if let Some(file) = &self.peer_scans {
            write_scans(file, self.resolution, self.range, &at_poses).map_err(CliError::failed)?;
        }
        let map = self.mapped(&at_poses, output)?;
        output.print(&Viewpoints::of(&map, scans.len()))?;
        let Some(file) = &self.peer_states else { return Ok(()) };
        let peer = PeerStates::read(file).map_err(CliError::failed)?;
        output.note(format!("the peer takes {} bytes", count(peer.memory_bytes as usize)));
        output.say(Line::HEAD)?;
        let view = map.view().with_viewpoints();
        let free: Vec<VoxelKey> = peer.free.into_iter().filter(|&voxel| !view.contains(voxel, 0)).collect();
        output.print(&Line::of("free", &States::of(&view, &free)))?;
        output.print(&Line::of("occupied", &States::of(&view, &peer.occupied)))?;
        let [in_order, shuffled] = speeds(&view, &free, 1);
        output.note(format!("{in_order:.1} million voxels a second in order, {shuffled:.1} shuffled"));
        Ok(())
    }

    fn mapped(&self, scans: &[(&Scan, Pose)], output: &Output) -> Result<MultiResolutionMap, CliError> {
        let map = MultiResolutionMap::new(self.map.settings(self.resolution)?).map_err(CliError::usage)?;
        let robot = RobotName::new("experiment").map_err(CliError::failed)?;
        let viewpoints = ViewpointSettings { range_max_m: self.range as f32, ..ViewpointSettings::default() };
        let settings = MappingSettings { viewpoints, ..MappingSettings::default() };
        let output = output.clone().with_bar_of(scans.len(), "scans");
        map_at_poses(&map, scans, settings, (&robot, self.sensor), || output.step())
            .map_err(CliError::failed)?;
        output.clear_bar();
        Ok(map)
    }
}

/// The viewpoints of a map.
#[derive(Debug, Serialize)]
struct Viewpoints {
    scans: usize,
    viewpoints: usize,
    stored_bytes: usize,
    memory_bytes: usize,
}

impl Viewpoints {
    fn of(map: &MultiResolutionMap, scans: usize) -> Self {
        let viewpoints = map.viewpoints();
        let (stored_bytes, memory_bytes) = (viewpoints.stored_bytes(), viewpoints.memory_bytes());
        Self { scans, viewpoints: viewpoints.len(), stored_bytes, memory_bytes }
    }
}

impl Display for Viewpoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scans, viewpoints, stored_bytes, memory_bytes } = self;
        let each = |bytes: &usize| bytes / (*viewpoints).max(1);
        write!(
            f,
            "{scans} scans left {viewpoints} viewpoints of {} bytes each where they are stored, {} in memory",
            each(stored_bytes),
            each(memory_bytes)
        )
    }
}

/// The states of the voxels that the peer calls one thing.
#[derive(Debug, Serialize)]
struct Line {
    peer: &'static str,
    voxels: usize,
    free: f64,
    occupied: f64,
    unknown: f64,
}

impl Line {
    const HEAD: &'static str = "peer        voxels      free  occupied   unknown";

    fn of(peer: &'static str, states: &States) -> Self {
        let share = |of: usize| of as f64 / states.total().max(1) as f64;
        let [free, occupied, unknown] = [states.free, states.occupied, states.unknown].map(share);
        Self { peer, voxels: states.total(), free, occupied, unknown }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [free, occupied, unknown] = [self.free, self.occupied, self.unknown].map(percent);
        write!(f, "{:<9} {:>8} {free:>9} {occupied:>9} {unknown:>9}", self.peer, self.voxels)
    }
}
