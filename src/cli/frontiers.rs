//! `mrol frontiers`: asks where free space ends and nothing is known beyond.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::remote::MapOptions;
use super::scope::ScopeOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol::json::JsonPose;
use mrol_map::planning::Frontier;
use mrol_service::FrontierQuestion;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol frontiers --map office --box \"0 0 0 20 10 3\"
  mrol frontiers --map office --box \"0 0 0 20 10 3\" --level 1 --size-min 50 --standoff 2 --json

A frontier is free voxels beside unknown ones; each is told with a place from which it can be seen. The largest come first.";

/// Ask a server for frontiers: where free space ends and nothing is known beyond
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ListFrontiers {
    #[command(flatten)]
    map: MapOptions,
    /// Where to look: smallest and largest corner, meters
    #[arg(long, value_name = "X Y Z X Y Z", allow_hyphen_values = true, value_parser = parse::corners)]
    r#box: ([f64; 3], [f64; 3]),
    /// Least number of voxels of a frontier [default: 8]
    #[arg(long, value_name = "N")]
    size_min: Option<u64>,
    /// Most frontiers to tell [default: 100]
    #[arg(long, value_name = "N")]
    most: Option<usize>,
    /// How far from a frontier it is looked at, meters [default: 20 voxels]
    #[arg(long, value_name = "METERS")]
    standoff: Option<f64>,
    #[command(flatten)]
    asked: ScopeOptions,
}

impl ListFrontiers {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { map, r#box: (min_m, max_m), size_min, most, standoff, asked } = self;
        let (asked, standoff_m) = (asked.scope(), standoff);
        let question = FrontierQuestion { asked, min_m, max_m, size_min, frontiers_max: most, standoff_m };
        let client = map.server.connect().await?;
        let answered = client.list_frontiers(&map.name, question).await?;
        let (told, revision) = (answered.answer, answered.version.revision);
        for frontier in &told.frontiers {
            output.print(&FrontierLine::of(frontier, revision))?;
        }
        let (listed, total) = (told.frontiers.len(), told.frontiers_total);
        output.say(format!("{} of {total} frontiers, {} voxels in all", count(listed), told.voxels_total))
    }
}

#[derive(Serialize)]
struct FrontierLine {
    voxels: u64,
    center_m: [f64; 3],
    min_m: [f64; 3],
    max_m: [f64; 3],
    map_from_view: Option<JsonPose>,
    yaw_rad: Option<f64>,
    elevation_rad: Option<f64>,
    revision: u64,
}

impl FrontierLine {
    fn of(frontier: &Frontier, revision: u64) -> Self {
        let Frontier { voxels, center_m, min_m, max_m, view } = *frontier;
        Self {
            voxels,
            center_m,
            min_m,
            max_m,
            map_from_view: view.map(|view| (&view.map_from_view).into()),
            yaw_rad: view.map(|view| view.yaw_rad),
            elevation_rad: view.map(|view| view.elevation_rad),
            revision,
        }
    }
}

impl Display for FrontierLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.center_m;
        write!(f, "{:>8} voxels around {x:.2} {y:.2} {z:.2}", self.voxels)?;
        match (&self.map_from_view, self.yaw_rad) {
            (Some(JsonPose { translation_m: [x, y, z], .. }), Some(yaw_rad)) => {
                write!(f, ", seen from {x:.2} {y:.2} {z:.2} at {:.0} degrees", yaw_rad.to_degrees())
            }
            _ => write!(f, ", seen from nowhere"),
        }
    }
}
