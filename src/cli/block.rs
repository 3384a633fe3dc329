//! `mrol block`: takes a part of a map out, as masks or as distances.

use std::fmt;
use std::fmt::Display;
use std::fs;
use std::path::PathBuf;

use bytes::Bytes;
use serde::Serialize;

use super::remote::MapOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol_map::map::{DistanceBlock, Region};
use mrol_service::{BlockAnswer, BlockForm, BlockRequest, BlockVoxels};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol block --map office --box \"0 0 0 5 5 2\"                      how much a box holds
  mrol block --map office --level 2 --out office.blocks              all occupied voxels of a level
  mrol block --map office --box \"0 0 0 5 5 2\" --dense --out box.u8
  mrol block --map office --box \"0 0 0 5 5 2\" --dense --cap 0.5 --level 1

--out writes 72 bytes a block: its packed key and its 8 x 8 x 8 voxels, a bit each. With --dense it writes a byte
a cell, x fastest: how far the cell's center is from the nearest occupied voxel, in quarters of the voxel's side.";

/// Take a part of a map on a server out: voxels as masks, or distances
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Block {
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    part: Part,
    /// Level of the voxels: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Ask for the distance of each cell of the box from what is occupied
    #[arg(long, requires = "cuboid")]
    dense: bool,
    /// Distances need not be told beyond this, meters [default: 63.75 cells]
    #[arg(long, value_name = "M", requires = "dense")]
    cap: Option<f64>,
    /// Write the bytes of the answer
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Of which part; of all, where none is said.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
struct Part {
    /// The voxels in a box: smallest and largest corner, meters
    #[arg(long = "box", value_name = "X Y Z X Y Z", allow_hyphen_values = true, value_parser = parse::cuboid)]
    cuboid: Option<Region>,
    /// The voxels in a sphere: center and radius, meters
    #[arg(long, value_name = "X Y Z R", allow_hyphen_values = true, value_parser = parse::ball)]
    sphere: Option<Region>,
    /// The voxels in a box of any orientation: its center, its rotation as a unit quaternion, and its sides, meters
    #[arg(long, value_name = "X Y Z QX QY QZ QW SX SY SZ", allow_hyphen_values = true, value_parser = parse::oriented_box)]
    oriented_box: Option<Region>,
}

impl Block {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let request = self.request();
        let client = self.map.server.connect().await?;
        let (report, bytes) = report(client.get_block(&self.map.name, request).await?)?;
        if let Some(path) = &self.out {
            fs::write(path, &bytes).map_err(CliError::writing(path))?;
        }
        output.print(&report)
    }

    fn request(&self) -> BlockRequest {
        let Part { cuboid, sphere, oriented_box } = self.part;
        let region = cuboid.or(sphere).or(oriented_box);
        let form = match region.filter(|_| self.dense) {
            Some(region) => BlockForm::Dense { region, cap_m: self.cap },
            None => BlockForm::Sparse { region },
        };
        BlockRequest { level: self.level, form }
    }
}

/// What is told of a block.
#[derive(Serialize)]
struct Report {
    level: u32,
    resolution_m: f64,
    revision: u64,
    map_uuid: String,
    #[serde(flatten)]
    voxels: Voxels,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Voxels {
    Sparse { blocks: usize, voxels: usize },
    Dense { origin: [i32; 3], size: [usize; 3], cap: u8, occupied: usize },
}

/// What is told of an answer, and its bytes.
fn report(answer: BlockAnswer) -> Result<(Report, Bytes), CliError> {
    let (voxels, bytes) = match answer.voxels {
        BlockVoxels::Sparse(blocks) => {
            let voxels = blocks.to_set().map_err(CliError::failed)?.len();
            (Voxels::Sparse { blocks: blocks.len(), voxels }, blocks.into_bytes())
        }
        BlockVoxels::Dense(DistanceBlock { origin, size, cap, distances }) => {
            let occupied = distances.iter().filter(|&&distance| distance == 0).count();
            (Voxels::Dense { origin, size, cap: cap.get(), occupied }, distances.into())
        }
    };
    let (revision, map_uuid) = (answer.version.revision, answer.version.map_uuid.to_string());
    let (level, resolution_m) = (answer.level, answer.resolution_m);
    Ok((Report { level, resolution_m, revision, map_uuid, voxels }, bytes))
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.voxels {
            Voxels::Sparse { blocks, voxels } => {
                write!(f, "{} voxels in {} blocks", count(*voxels), count(*blocks))?;
            }
            Voxels::Dense { origin: [x, y, z], size: [xs, ys, zs], cap, occupied } => {
                write!(f, "{xs} x {ys} x {zs} cells from {x} {y} {z} on, {} occupied", count(*occupied))?;
                write!(f, "; distances up to {} m", f64::from(*cap) * self.resolution_m / 4.0)?;
            }
        }
        write!(f, ", of {} m, at revision {}", self.resolution_m, self.revision)
    }
}
