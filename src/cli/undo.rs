//! `mrol undo`: takes scans and deletions back.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::remote::MapOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol_map::map::{RequestId, RobotName, SessionName};
use mrol_service::{UndoAnswer, UndoTarget};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol undo --map office --robot r1 --scan-id 7          one scan, by the robot's own number
  mrol undo --map office --revision 41                   one scan or deletion, by the revision that it made
  mrol undo --map office --robot r1 --since 40           all that r1 sent after revision 40

Of scans, removes the voxels that only they touched; of a deletion, brings back what it removed. Everything
else stays as it is. Undone scans sent again are not inserted: send them under new numbers. An undo is not
undone. `mrol maps show` prints how far back undo can go.";

/// Take back scans or a deletion of a map on a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Undo {
    #[command(flatten)]
    map: MapOptions,
    /// Name of the robot that sent the scans
    #[arg(long, value_name = "NAME", value_parser = parse::robot_name)]
    robot: Option<RobotName>,
    /// The robot's own number of the scan
    #[arg(long, value_name = "N", requires = "robot")]
    scan_id: Option<u64>,
    /// The session in which the robot sent it; without, that of clients that name none
    #[arg(long, value_name = "NAME", requires = "scan_id", value_parser = parse::session_name)]
    session: Option<SessionName>,
    /// All of the robot's scans that made a revision after this one
    #[arg(long, value_name = "REVISION", requires = "robot", conflicts_with = "scan_id")]
    since: Option<u64>,
    /// The scan or deletion that made this revision
    #[arg(long, value_name = "N", conflicts_with_all = ["robot", "scan_id", "since"])]
    revision: Option<u64>,
    /// An id of this undo, which makes it safe to send again
    #[arg(long, value_name = "ID", value_parser = parse::request_id)]
    request_id: Option<RequestId>,
}

impl Undo {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let target = match (self.robot, self.scan_id, self.since, self.revision) {
            (Some(robot), Some(scan_id), ..) => {
                UndoTarget::Scan { robot, session: self.session.unwrap_or_default(), scan_id }
            }
            (Some(robot), None, Some(revision), _) => UndoTarget::RobotSince { robot, revision },
            (None, .., Some(revision)) => UndoTarget::Revision(revision),
            _ => {
                return Err(CliError::usage(
                    "nothing to undo is named: give --robot with --scan-id or --since, or --revision",
                ));
            }
        };
        let undo = mrol_service::Undo { target, request_id: self.request_id };
        let client = self.map.server.connect().await?;
        let answer = client.undo(&self.map.name, undo).await?;
        output.print(&Undone::from(answer))
    }
}

#[derive(Serialize)]
struct Undone {
    scans: usize,
    deletions: usize,
    removed: usize,
    restored: usize,
    replayed: bool,
    revision: u64,
    map_uuid: String,
}

impl From<UndoAnswer> for Undone {
    fn from(answer: UndoAnswer) -> Self {
        let UndoAnswer { scans, deletions, removed, restored, version, replayed } = answer;
        let (revision, map_uuid) = (version.revision, version.map_uuid.to_string());
        Self { scans, deletions, removed, restored, replayed, revision, map_uuid }
    }
}

impl Display for Undone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Self { scans, deletions, removed, restored, revision, .. } = self;
        let what = match deletions {
            0 => format!("{} scans", count(scans)),
            1 => "a deletion".to_owned(),
            more => format!("{} deletions", count(more)),
        };
        let (removed, restored) = (count(removed), count(restored));
        write!(f, "{what} undone: {removed} voxels removed, {restored} restored; revision {revision}")
    }
}
