//! The command `mrol export`.

use std::path::PathBuf;

use super::exported::{Content, Exported};
use super::octree::MapOctree;
use super::{cloud, npz, recording, survey};
use crate::cli::map_source::MapSourceOptions;
use mrol::console::{CliError, NewFile, Output, check_is_no_input, parse};
use mrol_files::FileKind;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol export hall.mrol --out hall.ply                a map file, as `mrol map` and `mrol snapshot` write it
  mrol export --map office --out office.pcd           a map of a server
  mrol export --map office --level 2 --out far.ply    one point for each voxel four times as large
  mrol export hall.mrol --out hall.bt                 an octree of OctoMap, with free space
  mrol export hall.mrol --out hall.npz                arrays for numpy.load
  mrol export site.mrol --out site.laz                a survey, in its coordinates; .las and .e57 too
  mrol export hall.mrol --out hall.mcap               voxels, grid and ways of the robots, for Foxglove

.ply and .pcd have a point at the center of each occupied voxel of the level, x y z as float32 in the map frame, meters,
binary and little-endian. The origin of a map of a survey is printed and not added: float32 would round the sums.
.bt and .ot are octrees of OctoMap whose cells are the voxels of the level. A cell is free if `mrol classify` says so of its
center; only cells in the box around the occupied ones are asked, and keep-outs do not count. The probabilities of .ot
are OctoMap's limits for occupied and free: nobody measured them.
.las, .laz and .e57 have the same centers in the coordinates of the survey: the map's origin is added in double precision. LAS
is 1.2 with steps of 0.1 mm up to 214 km from the origin, E57 has one scan in double precision without a pose.
.npz has the arrays points (float64, in the coordinates of the survey), indices, resolution, origin, level and revision.
.mcap has voxels, a grid, the ways of the robots and their frames as messages of ROS 2.
The file is a picture of the map: scans and trajectory are in map files alone, which `mrol snapshot` writes.";

/// Write a map as a file of other programs: .ply .pcd .bt .ot .npz .las .laz .e57 .mcap
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Export {
    #[command(flatten)]
    map: MapSourceOptions,
    /// Level of the voxels: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Leave free space out of .bt and .ot: occupied cells alone
    #[arg(long)]
    no_free: bool,
    /// Of a .mcap: lowest and highest height above the floor, meters, of what its grid shows
    #[arg(long, value_name = "Z Z", allow_hyphen_values = true, value_parser = parse::band, default_value = "0.1 1.8")]
    band: [f64; 2],
    /// The file to write; its extension says what it holds
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Export {
    pub(crate) async fn run(self, output: Output) -> Result<(), CliError> {
        let kind = self.kind()?;
        check_is_no_input(&self.out, self.map.file.as_deref())?;
        let out = NewFile::at(&self.out)?;
        let mut source = self.map.open().await?;
        let voxels = source.voxels(self.level).await?;
        let content = match kind {
            FileKind::Ply | FileKind::Pcd => cloud::write(kind, &out, &voxels)?,
            FileKind::Npz => npz::write(&out, &voxels, &output)?,
            FileKind::Bt | FileKind::Ot if self.no_free => {
                Content::Octree(MapOctree::occupied(&voxels)?.write(kind, &out)?)
            }
            FileKind::Bt | FileKind::Ot => {
                let free_space = source.free_space(&voxels)?;
                let tree = MapOctree::with_free_space(&voxels, &free_space, &output).await?;
                Content::Octree(tree.write(kind, &out)?)
            }
            FileKind::Las | FileKind::Laz | FileKind::E57 => survey::write(kind, &out, &voxels, &output)?,
            FileKind::Mcap => recording::write(&out, &voxels, source, self.band, &output).await?,
        };
        out.keep()?;
        output.print(&Exported::of(&self.out, content, &voxels))
    }

    /// What is to be written.
    fn kind(&self) -> Result<FileKind, CliError> {
        let kind = FileKind::of(&self.out).ok_or_else(|| self.unknown())?;
        kind.checked().map_err(CliError::usage)
    }

    fn unknown(&self) -> CliError {
        let extensions = FileKind::extensions();
        CliError::usage(format!("--out must end in one of {extensions}, got {}", self.out.display()))
    }
}
