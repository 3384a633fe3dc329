//! `mrol observers`: lists the scans that touched a voxel.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::remote::MapOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::json::{JsonObservers, JsonObservingScan};
use mrol_map::geometry::Point;
use mrol_service::{ObservedVoxel, ObserversAnswer, ObserversRequest};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol observers --map office --point 1.0,2.5,0.3             the scans that put something there
  mrol observers --map office --point 1.0,2.5,0.3 --level 3   or into the coarser voxel around it
  mrol --json observers --map office --point 1.0,2.5,0.3 | jq .scans[].revision

The newest comes first. `mrol undo --revision` takes one of them back. Scans that were undone are not listed, and
not those from before what the journal reaches back to, which `mrol maps show` prints.";

/// List the scans that touched a voxel of a map on a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Observers {
    #[command(flatten)]
    map: MapOptions,
    /// A point in the voxel, meters
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point)]
    point: Point,
    /// Level of the voxel: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
}

impl Observers {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let request = ObserversRequest { voxel: ObservedVoxel::Of(self.point), level: self.level };
        let client = self.map.server.connect().await?;
        let answer = client.list_observers(&self.map.name, request).await?;
        output.print(&Report::from(answer))
    }
}

/// The answer, to be printed.
#[derive(Serialize)]
#[serde(transparent)]
struct Report(JsonObservers);

impl From<ObserversAnswer> for Report {
    fn from(answer: ObserversAnswer) -> Self {
        Self(answer.into())
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let JsonObservers { voxel: [x, y, z], scans, older_scans, version } = &self.0;
        let more = if *older_scans { "; there are older ones, or may be" } else { "" };
        let (count, revision) = (scans.len(), version.revision);
        write!(f, "voxel {x} {y} {z}, at revision {revision}: touched by {count} scans{more}")?;
        scans.iter().try_for_each(|scan| write_scan(f, scan))
    }
}

fn write_scan(f: &mut fmt::Formatter<'_>, scan: &JsonObservingScan) -> fmt::Result {
    let [x, y, z] = scan.map_from_sensor.translation_m;
    write!(f, "\nrevision {}: {}", scan.revision, scan.robot)?;
    if let Some(scan_id) = scan.scan_id {
        write!(f, ", scan {scan_id}")?;
    }
    if !scan.session.is_empty() {
        write!(f, " of session {}", scan.session)?;
    }
    write!(f, ", from {x:.2} {y:.2} {z:.2}")
}
