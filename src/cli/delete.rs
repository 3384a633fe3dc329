//! `mrol delete`: deletes voxels from a map.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;

use serde::Serialize;

use super::remote::MapOptions;
use super::survey::SurveyOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol_map::map::{Region, RequestId};
use mrol_service::{Deletion, DeletionAnswer, DeletionTarget};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol delete --map office --box \"0 0 0 2.5 2.5 2\"              all voxels in a box
  mrol delete --map office --sphere \"1.5 2 0.8 0.4\"
  mrol delete --map office --point 1.0,2.5,0.3 --level 2        a coarse voxel with all it contains
  mrol delete --map office --points gone.ply
  mrol delete --map office --box \"0 0 0 9 9 3\" --not-seen-since 120   what was taken away since revision 120

A region deletes the voxels whose centers are inside. Voxels that do not exist are no error.";

/// Delete voxels from a map on a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Delete {
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    survey: SurveyOptions,
    #[command(flatten)]
    target: Target,
    /// Level of the voxels; all their descendants are deleted too
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Of a region, only what no scan after this revision touched although one saw through it
    #[arg(long, value_name = "REVISION")]
    not_seen_since: Option<u64>,
    /// An id of this deletion, which makes it safe to send again
    #[arg(long, value_name = "ID", value_parser = parse::request_id)]
    request_id: Option<RequestId>,
}

#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct Target {
    /// The voxels of a file's points: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// The voxel of a point, meters; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::vector)]
    point: Vec<[f64; 3]>,
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

impl Delete {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { map, survey, target, level, request_id, not_seen_since } = self;
        let region = target.region().map(DeletionTarget::Region);
        let check = |of: DeletionTarget| of.not_seen_since(not_seen_since).map_err(CliError::usage);
        // What needs no server is said before one is called.
        let region = region.map(check).transpose()?;
        let client = map.server.connect().await?;
        let target = match region {
            Some(region) => region,
            None => {
                let file = target.points.as_deref();
                let points = survey.points(&client, &map.name, file, &target.point).await?;
                check(DeletionTarget::Points(points.into()))?
            }
        };
        let deletion = Deletion { target, level, request_id };
        let answer = client.delete_voxels(&map.name, deletion).await?;
        output.print(&Deleted::from(answer))
    }
}

impl Target {
    fn region(&self) -> Option<Region> {
        self.cuboid.or(self.sphere).or(self.oriented_box)
    }
}

#[derive(Serialize)]
struct Deleted {
    removed: usize,
    replayed: bool,
    revision: u64,
    map_uuid: String,
}

impl From<DeletionAnswer> for Deleted {
    fn from(answer: DeletionAnswer) -> Self {
        let (revision, map_uuid) = (answer.version.revision, answer.version.map_uuid.to_string());
        Self { removed: answer.removed, replayed: answer.replayed, revision, map_uuid }
    }
}

impl Display for Deleted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} voxels removed; revision {}", count(self.removed), self.revision)
    }
}
