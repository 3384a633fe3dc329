//! The command `mrol export`.

use std::path::PathBuf;

use super::cloud;
use super::exported::Exported;
use super::recording;
use super::source::Source;
use crate::cli::remote::ServerOptions;
use mrol::console::{CliError, Output, parse};
use mrol_files::FileKind;
use mrol_map::map::MapName;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol export hall.mrol --out hall.ply                a map file, as `mrol map` and `mrol snapshot` write it
  mrol export --map office --out office.pcd           a map of a server
  mrol export --map office --level 2 --out far.ply    one point for each voxel four times as large
  mrol export hall.mrol --out hall.mcap               voxels, grid and ways of the robots, for Foxglove

A .ply or .pcd file has a point at the center of each occupied voxel of the level, x y z as float32 in the map frame, meters,
binary and little-endian. The origin of a map of a survey is printed and not added: float32 would round the sums. The file is
a picture of the map: scans, trajectory and free space are in map files alone, which `mrol snapshot` writes.";

/// Write a map as a file of other programs: .ply or .pcd
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Export {
    /// A map file, as `mrol map --out` and `mrol snapshot` write it
    #[arg(value_name = "FILE.mrol", required_unless_present = "name", conflicts_with = "name")]
    file: Option<PathBuf>,
    /// Instead of a file: the name of a map on a server
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    name: Option<MapName>,
    #[command(flatten)]
    server: ServerOptions,
    /// Level of the voxels: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
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
        let source = Source::open(self.file.as_deref(), self.name.clone(), &self.server).await?;
        let voxels = source.voxels(self.level).await?;
        let written = match kind {
            FileKind::Ply | FileKind::Pcd => cloud::write(kind, &self.out, &voxels),
            FileKind::Bt | FileKind::Ot | FileKind::Npz => Err(self.unknown()),
            FileKind::Las | FileKind::Laz | FileKind::E57 => Err(self.unknown()),
            FileKind::Mcap => recording::write(&self.out, &voxels, source, self.band, &output).await,
        };
        written?;
        output.print(&Exported::of(&self.out, &voxels))
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
