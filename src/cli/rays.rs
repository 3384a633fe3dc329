//! `mrol rays`: asks what rays meet.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::met::met;
use super::remote::MapOptions;
use super::scope::ScopeOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_map::geometry::Point;
use mrol_map::planning::Unknown;
use mrol_service::{RayQuestion, RaysToward};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol rays --map office --from 1,2,0.5 --direction 1,0,0           how far it is to the next wall along x
  mrol rays --map office --from 1,2,0.5 --direction 0.6,0.8,0 --direction 0,0,1 --range 10
  mrol rays --map office --from 1,2,0.5 --to 4,2,0.5                is there a line of sight?
  mrol rays --map office --from 1,2,0.5 --to 4,2,0.5 --unknown occupied     and is all of it known to be free?

A direction is a unit vector. A ray meets the first occupied voxel in which it runs for some way.";

/// Ask a server what rays meet, and how far away
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct CastRays {
    #[command(flatten)]
    map: MapOptions,
    /// Where the rays begin, meters
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point)]
    from: Point,
    /// Direction of a ray, a unit vector; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point, required_unless_present = "to", conflicts_with = "to")]
    direction: Vec<Point>,
    /// Where a ray ends, meters; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point)]
    to: Vec<Point>,
    /// Length of the rays with a direction, meters [default: as far as the map goes]
    #[arg(long, value_name = "METERS", requires = "direction")]
    range: Option<f64>,
    /// What voxels count as that no scan saw through: free, or occupied, so that a ray ends where nothing was seen
    #[arg(long, value_parser = parse::keyword::<Unknown>(), default_value = "free")]
    unknown: Unknown,
    #[command(flatten)]
    asked: ScopeOptions,
}

impl CastRays {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { map, from, direction, to, range, unknown, asked } = self;
        let toward = if to.is_empty() {
            let range_m = range.unwrap_or(f64::INFINITY);
            RaysToward::Directions { directions: direction.into(), range_m }
        } else {
            RaysToward::Ends(to.into())
        };
        let question = RayQuestion { asked: asked.scope(), origins: vec![from].into(), toward, unknown };
        let client = map.server.connect().await?;
        let answered = client.cast_rays(&map.name, question).await?;
        let (hits, revision) = (answered.answer, answered.version.revision);
        (0..hits.len()).try_for_each(|ray| {
            let hit = hits.hit[ray / 64] >> (ray % 64) & 1 == 1;
            let distance_m = hit.then(|| hits.distances_m[ray]);
            let keep_out = hits.keep_outs.get(ray).cloned().flatten().map(|name| name.to_string());
            let voxel = (hit && keep_out.is_none()).then(|| hits.voxels[ray].index());
            output.print(&RayLine { ray, hit, distance_m, voxel, keep_out, revision })
        })
    }
}

#[derive(Serialize)]
struct RayLine {
    ray: usize,
    hit: bool,
    distance_m: Option<f32>,
    voxel: Option<[i32; 3]>,
    keep_out: Option<String>,
    revision: u64,
}

impl Display for RayLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.distance_m {
            Some(distance_m) => {
                let met = met(self.voxel, self.keep_out.as_deref());
                write!(f, "ray {} meets {met} after {distance_m:.4} m", self.ray)
            }
            None => write!(f, "ray {} meets nothing", self.ray),
        }
    }
}
