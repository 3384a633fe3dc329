//! `mrol export`: writes the occupied voxels of a map as a point cloud, for programs that know nothing of maps.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::Serialize;

use super::remote::ServerOptions;
use mrol::console::{CliError, Output, count, parse};
use mrol_map::geometry::Point;
use mrol_map::map::{MapName, MapOrigin};
use mrol_map::scan::{write_pcd, write_ply};
use mrol_map::voxel::{Lattice, VoxelKey};
use mrol_service::ListingRequest;
use mrol_store::{Disk, Snapshot};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol export hall.mrol --out hall.ply                a map file, as `mrol map` and `mrol snapshot` write it
  mrol export --map office --out office.pcd           a map of a server
  mrol export --map office --level 2 --out far.ply    one point for each voxel four times as large

The file has a point at the center of each occupied voxel of the level, x y z as float32 in the map frame, meters, binary
and little-endian. The origin of a map of a survey is printed and not added: float32 would round the sums. The file is a
picture of the map: scans, trajectory and free space are in map files alone, which `mrol snapshot` writes.";

/// Write the occupied voxels of a map as a point cloud: .ply or .pcd
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Export {
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
    /// The file to write: .ply or .pcd
    #[arg(long, value_name = "CLOUD")]
    out: PathBuf,
}

impl Export {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let write = writer_of(&self.out)?;
        let (voxels, origin) = match (&self.file, &self.name) {
            (Some(file), _) => self.voxels_of_file(file)?,
            (None, Some(name)) => self.voxels_of_server(name).await?,
            (None, None) => return Err(CliError::usage("a map file or --map is needed")),
        };
        let Voxels { resolution_m, revision, keys } = voxels;
        let center = |key: &VoxelKey| {
            let [x, y, z] = key.index().map(|i| (f64::from(i) + 0.5) * resolution_m);
            Point::from(Point3::new(x, y, z))
        };
        // The same map gives the same file, wherever it was read from.
        let keys: BTreeSet<VoxelKey> = keys.into_iter().collect();
        let points: Vec<Point> = keys.iter().map(center).collect();
        write(&self.out, &points).map_err(CliError::writing(&self.out))?;
        let (points, level) = (points.len(), self.level);
        let origin_m = origin.map(|origin| origin.position_m);
        let out = self.out.display().to_string();
        output.print(&Exported { out, points, level, resolution_m, revision, origin_m })
    }

    fn voxels_of_file(&self, file: &Path) -> Result<(Voxels, Option<MapOrigin>), CliError> {
        let Snapshot { settings, contents, .. } = Snapshot::read(&Disk::default(), file)?;
        if self.level >= settings.levels {
            let message = format!("--level must be 0 to {}, got {}", settings.levels - 1, self.level);
            return Err(CliError::usage(message));
        }
        let lattice = Lattice::new(settings.resolution_m, settings.levels).map_err(CliError::failed)?;
        let keys = contents.voxels.iter().map(|key| key.ancestor(self.level)).collect();
        let resolution_m = lattice.resolution_m(self.level);
        Ok((Voxels { resolution_m, revision: contents.revision, keys }, settings.origin))
    }

    async fn voxels_of_server(&self, name: &MapName) -> Result<(Voxels, Option<MapOrigin>), CliError> {
        let client = self.server.connect().await?;
        let origin = client.map_info(name).await?.settings.origin;
        let listing = client.list_voxels(name, ListingRequest::of(self.level, None)).await?;
        let (resolution_m, revision) = (listing.resolution_m, listing.version.revision);
        Ok((Voxels { resolution_m, revision, keys: listing.keys }, origin))
    }
}

/// The occupied voxels of a level, in any order and some of them several times.
struct Voxels {
    /// Side of a voxel, meters.
    resolution_m: f64,
    revision: u64,
    keys: Vec<VoxelKey>,
}

/// Writes points to a file.
type WritePoints = fn(&Path, &[Point]) -> io::Result<()>;

/// What writes a file of this extension.
fn writer_of(path: &Path) -> Result<WritePoints, CliError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "ply" => Ok(write_ply),
        "pcd" => Ok(write_pcd),
        _ => Err(CliError::usage(format!("--out must end in .ply or .pcd, got {}", path.display()))),
    }
}

#[derive(Serialize)]
struct Exported {
    out: String,
    points: usize,
    level: u32,
    resolution_m: f64,
    revision: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin_m: Option<[f64; 3]>,
}

impl Display for Exported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { out, points, resolution_m, revision, .. } = self;
        let points = count(*points);
        write!(
            f,
            "{out}: {points} points, the centers of voxels of {resolution_m} m, at revision {revision}"
        )?;
        if let Some([x, y, z]) = self.origin_m {
            write!(f, "; add {x} {y} {z} for the coordinates of the survey")?;
        }
        Ok(())
    }
}
