//! `mrol watch`: tells of a map's changes as they come.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::remote::MapOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol_map::geometry::translation_m;
use mrol_map::map::{ContentHash, KeepOutAct, Region};
use mrol_service::{Cause, ChangePart, StatePart, WatchEvent, WatchForm, WatchMessage, WatchRequest};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol watch --map office                                    a line for each change, from now on
  mrol watch --map office --level 2                          voxels of level 2 that really appeared or went
  mrol watch --map office --box \"0 0 0 2.5 2.5 2\" --revisions 10
  mrol --json watch --map office | jq .revision

The first line tells of what the map holds. Of each change, the voxels are counted that it touched, new or not;
with --level, those that appeared and went. It goes on until it is interrupted, or the map is deleted.";

/// Watch a map on a server: a line for each change
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Watch {
    #[command(flatten)]
    map: MapOptions,
    /// Tell of the voxels of this level that appear and go
    #[arg(long)]
    level: Option<u32>,
    /// Only of voxels whose centers lie in a box: smallest and largest corner, meters
    #[arg(long = "box", value_name = "X Y Z X Y Z", allow_hyphen_values = true, value_parser = parse::cuboid)]
    region: Option<Region>,
    /// End after so many revisions
    #[arg(long, value_name = "N")]
    revisions: Option<u64>,
}

impl Watch {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let form = self.level.map_or(WatchForm::Changes, |level| WatchForm::Deltas { level });
        let request = WatchRequest { region: self.region, form, ..WatchRequest::default() };
        let client = self.map.server.connect().await?;
        let mut messages = client.watch(&self.map.name, request).await?;
        let (mut line, mut told) = (Line::default(), 0);
        while self.revisions.is_none_or(|most| told < most) {
            let Some(message) = messages.next().await else { break };
            let Some(whole) = line.take(message?)? else { continue };
            told += u64::from(whole.what != "state");
            output.print(&whole)?;
        }
        Ok(())
    }
}

/// A change, or the state at the beginning.
#[derive(Debug, Clone, Default, Serialize)]
struct Line {
    revision: u64,
    head_revision: u64,
    map_uuid: String,
    what: &'static str,
    added: usize,
    removed: usize,
    content_hash: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    robot: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation_m: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    undone: Vec<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    keep_out: Option<String>,
}

impl Line {
    /// Takes a message; the line, once its last part is there.
    fn take(&mut self, message: WatchMessage) -> Result<Option<Self>, CliError> {
        (self.head_revision, self.map_uuid) = (message.head_revision, message.map_uuid.to_string());
        let is_last = match message.event {
            WatchEvent::Heartbeat => false,
            WatchEvent::State(part) => self.take_state(&part)?,
            WatchEvent::Change(part) => self.take_change(part)?,
        };
        Ok(is_last.then(|| std::mem::take(self)))
    }

    fn take_state(&mut self, part: &StatePart) -> Result<bool, CliError> {
        (self.what, self.revision) = ("state", part.version.revision);
        self.content_hash = Some(part.version.hash.to_string());
        self.added += part.voxels.to_set().map_err(CliError::failed)?.len();
        Ok(part.is_last)
    }

    fn take_change(&mut self, part: ChangePart) -> Result<bool, CliError> {
        self.revision = part.revision;
        self.content_hash = part.content_hash.as_ref().map(ContentHash::to_string);
        self.removed += part.removed.to_set().map_err(CliError::failed)?.len();
        self.added += part.added.to_set().map_err(CliError::failed)?.len();
        match part.cause {
            Cause::Deletion => self.what = "deletion",
            Cause::Scan(scan) => {
                self.what = "scan";
                self.robot = Some(scan.robot.to_string());
                self.translation_m = Some(translation_m(&scan.map_from_sensor));
            }
            Cause::Undo { scans, deletions } => {
                self.what = "undo";
                self.undone = [scans, deletions].concat();
            }
            Cause::KeepOut(change) => {
                self.what = match change.act {
                    KeepOutAct::Put { .. } => "keep-out put",
                    KeepOutAct::Removed { .. } => "keep-out removed",
                    KeepOutAct::Expired => "keep-out expired",
                };
                self.keep_out = Some(change.name.to_string());
            }
        }
        Ok(part.is_last)
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { revision, what, added, removed, .. } = self;
        write!(f, "revision {revision}: {what}")?;
        if let (Some(robot), Some([x, y, z])) = (&self.robot, self.translation_m) {
            write!(f, " of {robot} at {x:.2} {y:.2} {z:.2}")?;
        }
        if !self.undone.is_empty() {
            write!(f, " of {:?}", self.undone)?;
        }
        if let Some(keep_out) = &self.keep_out {
            return write!(f, ": {keep_out}");
        }
        match *what {
            "state" => write!(f, ", {} voxels", count(*added)),
            _ => write!(f, ", {} voxels come, {} go", count(*added), count(*removed)),
        }
    }
}
