//! `mrol classify`: asks what is known of points.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;

use serde::Serialize;

use super::remote::MapOptions;
use super::scope::ScopeOptions;
use super::survey::SurveyOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_map::util::Keyword;
use mrol_service::ClassifyQuestion;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol classify --map office --point 1,2,0.5 --point 4,2,0.5
  mrol classify --map office waypoints.xyz --level 1

A point is occupied where a voxel or a keep-out is, free where a scan saw through its voxel's center and nothing is there,
and unknown elsewhere.";

/// Ask a server what is known of points: occupied, free, or unknown
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Classify {
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
    #[command(flatten)]
    asked: ScopeOptions,
}

impl Classify {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { points_file, point, map, survey, asked } = self;
        let client = map.server.connect().await?;
        let points = survey.points(&client, &map.name, points_file.as_deref(), &point).await?;
        let question = ClassifyQuestion { asked: asked.scope(), points: points.clone().into() };
        let answered = client.classify_points(&map.name, question).await?;
        let (states, revision) = (answered.answer, answered.version.revision);
        if states.points != points.len() {
            let message = format!("the server answered {} of {} points", states.points, points.len());
            return Err(CliError::failed(message));
        }
        points.iter().enumerate().try_for_each(|(i, point)| {
            output.print(&ClassifiedLine { point: point.xyz(), state: states.state(i).as_str(), revision })
        })
    }
}

#[derive(Serialize)]
struct ClassifiedLine {
    point: [f32; 3],
    state: &'static str,
    revision: u64,
}

impl Display for ClassifiedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.point;
        write!(f, "{x:>10} {y:>10} {z:>10}   {}", self.state)
    }
}
