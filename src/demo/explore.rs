//! `mrol demo --explore`: a robot that nobody steers maps the building.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use super::explorer::{Explorer, Step, Visible, never_collided};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::{PlanLayer, plan};
use mrol::console::{count, percent};
use mrol_client::Client;
use mrol_map::map::MapName;
use mrol_map::planning::Frontier;
use mrol_map::voxel::{Lattice, VoxelKey};
use mrol_service::{ListingRequest, MapInfo};
use mrol_simulate::Scene;

/// Where the robot begins, meters: in the first room.
const START_M: [f64; 2] = [4.6, 6.9];
/// Ways after which the robot is stopped.
const WAYS_MAX: usize = 400;
/// Level at which what was mapped is compared with what there is to see.
const COMPARED_LEVEL: u32 = 1;
/// Share of what can be seen that has to be in the map.
const MAPPED_MIN: f64 = 0.95;
/// Heights of the voxels in the picture, meters: neither floor nor ceiling.
const PICTURE_M: [f64; 2] = [0.2, 2.2];

/// Lets a robot explore, line by line; what came of it.
pub(super) async fn explore(
    client: &Client,
    map: &MapInfo,
    seed: u64,
    picture: Option<&Path>,
    output: &Output,
) -> Result<Explored, CliError> {
    let start = Instant::now();
    let (scene, name) = (Arc::new(Scene::furnished(seed)), map.name.clone());
    let explorer = Explorer::new(client.clone(), name.clone(), Arc::clone(&scene), START_M, seed);
    let mut explorer = explorer.map_err(CliError::failed)?;
    explorer.look().await?;
    output.say(Line::HEAD)?;
    let mut frontiers_left = None;
    for way in 1..=WAYS_MAX {
        match explorer.step().await? {
            Step::Visited { frontier, way_m, listed, scan, error_m } => {
                let info = client.map_info(&name).await?;
                let voxels = info.levels.first().map_or(0, |finest| finest.voxels);
                let Frontier { voxels: size, center_m, .. } = *frontier;
                let accepted = scan.accepted;
                output.print(&Line {
                    seconds: start.elapsed().as_secs_f64(),
                    way,
                    way_m,
                    listed,
                    frontier: center_m,
                    size,
                    accepted,
                    error_m,
                    voxels,
                })?;
            }
            Step::Done { left } => {
                frontiers_left = Some(left);
                break;
            }
        }
    }
    let explored_s = start.elapsed().as_secs_f64();
    let lattice = Lattice::new(map.settings.resolution_m, map.settings.levels).map_err(CliError::failed)?;
    let visible = Visible::of(&scene, &Explorer::lidar(), START_M, &lattice, COMPARED_LEVEL);
    let mapped = mapped(client, &name).await?;
    let missing: BTreeSet<VoxelKey> = visible.voxels.difference(&mapped).copied().collect();
    if let Some(file) = picture {
        draw(file, &lattice, &mapped, &missing, explorer.path())?;
    }
    let path_m =
        explorer.path().windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum();
    Ok(Explored {
        seconds: explored_s,
        scans: explorer.scans(),
        path_m,
        frontiers_left,
        visible: visible.voxels.len(),
        mapped: 1.0 - missing.len() as f64 / visible.voxels.len().max(1) as f64,
        collided: !never_collided(&scene, explorer.path()),
    })
}

/// The voxels of the map at the level that is compared.
async fn mapped(client: &Client, map: &MapName) -> Result<BTreeSet<VoxelKey>, CliError> {
    let listing = ListingRequest { level: COMPARED_LEVEL, ..ListingRequest::default() };
    Ok(client.list_voxels(map, listing).await?.keys.into_iter().collect())
}

/// Draws what was mapped, what was left, and the robot's path from above.
fn draw(
    file: &Path,
    lattice: &Lattice,
    mapped: &BTreeSet<VoxelKey>,
    missing: &BTreeSet<VoxelKey>,
    path: &[[f64; 3]],
) -> Result<(), CliError> {
    let in_band = |voxels: &BTreeSet<VoxelKey>| -> BTreeSet<VoxelKey> {
        let is_in = |voxel: &&VoxelKey| {
            let [_, _, z] = lattice.center_m(**voxel, COMPARED_LEVEL);
            (PICTURE_M[0]..PICTURE_M[1]).contains(&z)
        };
        voxels.iter().filter(is_in).copied().collect()
    };
    let side_m = lattice.resolution_m(COMPARED_LEVEL);
    let path =
        path.iter().filter_map(|place| VoxelKey::new(place.map(|c| (c / side_m).floor() as i32))).collect();
    let (mapped, missing) = (in_band(mapped), in_band(missing));
    let layers = [
        PlanLayer { name: "mapped", color: "#888", voxels: &mapped },
        PlanLayer { name: "left", color: "#d33", voxels: &missing },
        PlanLayer { name: "path", color: "#26c", voxels: &path },
    ];
    plan(file, &layers)
}

/// What came of it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Explored {
    seconds: f64,
    scans: u64,
    path_m: f64,
    /// Frontiers that the robot cannot get to; none where it was stopped before.
    frontiers_left: Option<usize>,
    /// Voxels that can be seen from where it can stand.
    visible: usize,
    /// The share of them that is in the map.
    mapped: f64,
    collided: bool,
}

impl Explored {
    /// An error where too little was mapped, or the robot met something.
    pub(super) fn verdict(&self) -> Result<(), CliError> {
        if self.collided {
            return Err(CliError::failed("the robot met something on its way"));
        }
        if self.mapped < MAPPED_MIN {
            let (mapped, least) = (percent(self.mapped), percent(MAPPED_MIN));
            let message = format!("{mapped} of what can be seen was mapped, {least} is expected");
            return Err(CliError::failed(message));
        }
        Ok(())
    }
}

impl Display for Explored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, scans, path_m, frontiers_left, visible, mapped, collided } = self;
        writeln!(
            f,
            "\n{scans} scans, {path_m:.1} m in {seconds:.0} s; {}",
            match frontiers_left {
                Some(0) => "no frontier is left".to_owned(),
                Some(left) => format!("{left} frontiers are left that it cannot get to"),
                None => format!("stopped after {WAYS_MAX} ways"),
            }
        )?;
        writeln!(
            f,
            "{} of {} voxels of 10 cm that can be seen from where it can stand are in the map",
            percent(*mapped),
            count(*visible)
        )?;
        let met = if *collided { "it met something on its way" } else { "it met nothing on its way" };
        write!(f, "what no scan saw through counted as occupied; {met}")
    }
}

/// The line of one way.
#[derive(Debug, Serialize)]
struct Line {
    seconds: f64,
    way: usize,
    way_m: f64,
    listed: usize,
    frontier: [f64; 3],
    size: u64,
    accepted: bool,
    error_m: f64,
    voxels: usize,
}

impl Line {
    const HEAD: &'static str =
        "    s   way   meters  frontiers  to the frontier at    voxels  scan       off  map";
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, way, way_m, listed, frontier: [x, y, z], size, accepted, error_m, voxels } = self;
        let scan = if *accepted { "accepted" } else { "refused" };
        write!(
            f,
            "{seconds:>5.1}  {way:>4}  {way_m:>6.1}  {listed:>9}  {x:>5.1} {y:>5.1} {z:>4.1}  {size:>12}  {scan}  {:>3.0} mm  {}",
            error_m * 1e3,
            count(*voxels)
        )
    }
}
