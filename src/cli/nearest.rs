//! `mrol nearest`: asks how far the nearest occupied voxel is.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;

use serde::Serialize;

use super::met::met;
use super::remote::MapOptions;
use super::scope::ScopeOptions;
use super::survey::SurveyOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_map::planning::MeasuredTo;
use mrol_service::NearestQuestion;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol nearest --map office --point 1,2,0.5 --radius 1
  mrol nearest --map office waypoints.xyz --radius 0.5
  mrol nearest --map office --point 1,2,0.5 --radius 3 --level 2      further, and less finely

The radius is 64 voxels of the level at most. A point inside of an occupied voxel is 0 m away from it.";

/// Ask a server for the occupied voxel nearest to each point
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Nearest {
    /// Points to ask about: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(required_unless_present = "point", conflicts_with = "point")]
    points_file: Option<PathBuf>,
    /// A point to ask about, meters; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::vector)]
    point: Vec<[f64; 3]>,
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    survey: SurveyOptions,
    /// How far to look, meters
    #[arg(long, value_name = "METERS")]
    radius: f64,
    /// What distances are measured to: the voxels' cubes, or their centers
    #[arg(long, value_parser = parse::keyword::<MeasuredTo>(), default_value = "cubes")]
    to: MeasuredTo,
    #[command(flatten)]
    asked: ScopeOptions,
}

impl Nearest {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { points_file, point, map, survey, radius, to, asked } = self;
        let client = map.server.connect().await?;
        let points = survey.points(&client, &map.name, points_file.as_deref(), &point).await?;
        let question =
            NearestQuestion { asked: asked.scope(), points: points.clone().into(), radius_m: radius, to };
        let answered = client.find_nearest(&map.name, question).await?;
        let (nearest, revision) = (answered.answer, answered.version.revision);
        if nearest.len() != points.len() {
            let message = format!("the server answered {} of {} points", nearest.len(), points.len());
            return Err(CliError::failed(message));
        }
        points.iter().enumerate().try_for_each(|(i, point)| {
            let found = nearest.found[i / 64] >> (i % 64) & 1 == 1;
            let keep_out = nearest.keep_outs.get(i).cloned().flatten().map(|name| name.to_string());
            output.print(&NearestLine {
                point: point.xyz(),
                distance_m: found.then(|| nearest.distances_m[i]),
                voxel: (found && keep_out.is_none()).then(|| nearest.voxels[i].index()),
                keep_out,
                away: found.then(|| nearest.away[i]),
                revision,
            })
        })
    }
}

#[derive(Serialize)]
struct NearestLine {
    point: [f32; 3],
    distance_m: Option<f32>,
    voxel: Option<[i32; 3]>,
    keep_out: Option<String>,
    away: Option<[f32; 3]>,
    revision: u64,
}

impl Display for NearestLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.point;
        write!(f, "{x:>10} {y:>10} {z:>10}   ")?;
        match self.distance_m {
            Some(distance_m) => {
                write!(f, "{distance_m:.4} m to {}", met(self.voxel, self.keep_out.as_deref()))
            }
            None => write!(f, "nothing near"),
        }
    }
}
