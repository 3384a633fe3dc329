//! The audit: a log line for each change by an operator, for each scan that carved, for each key that was refused, and
//! where a robot's scans begin and cease to be refused.
//!
//! Lines have the target [`AUDIT`] and lie within the request's span, which says the protocol, the request id, the key
//! and the peer.

use std::sync::Arc;

use super::line_limit::LineLimit;
use super::refused_robots::RefusedRobots;
use mrol_map::map::{CallerName, MapName};
use mrol_service::{Change, End, Ended, JudgedScan, MapVersion, Observer, Outcome, Reason};

/// The target of the audit's lines.
pub const AUDIT: &str = "mrol::audit";

/// Operations whose refusal and failure are lines of their own; those that are done tell by their outcome.
const CHANGES: [&str; 6] = ["CreateMap", "RenameMap", "DeleteMap", "RestoreMap", "DeleteVoxels", "Undo"];

/// Operations after which a name is another map's, or none's.
const ANOTHER_MAP: [&str; 3] = ["RenameMap", "DeleteMap", "RestoreMap"];

/// Reasons for which somebody is not let in whose key is known.
const OF_KNOWN_KEYS: [&str; 5] =
    ["key_expired", "key_withdrawn", "map_not_allowed", "robot_not_allowed", "scope_too_small"];

/// Writes the audit. A clone is another handle on the same one.
#[derive(Debug, Clone, Default)]
pub struct Audit(Arc<Kinds>);

/// What is not written without bound, by who can cause it: strangers do not push the lines of known keys out.
#[derive(Debug, Default)]
struct Kinds {
    /// Requests that were not let in, without a key that is known.
    strangers: LineLimit,
    /// Requests that were not let in, with a key that is known.
    keys: LineLimit,
    /// Changes that failed.
    failed: LineLimit,
    /// Changes whose callers went away.
    gone: LineLimit,
    refused_robots: RefusedRobots,
}

impl Audit {
    /// A request was not let in, by the word `reason`; to be called within its span.
    pub fn denied(&self, reason: &str) {
        let kind = if OF_KNOWN_KEYS.contains(&reason) { &self.0.keys } else { &self.0.strangers };
        if let Some(unwritten) = kind.to_write() {
            tracing::info!(target: AUDIT, outcome = "denied", reason, unwritten, "not let in");
        }
    }
}

/// Writes a change that was made; `robot` is that of a scan that carved.
fn write_change(operation: &str, map: Option<&str>, change: &Change, robot: Option<&str>) {
    let Change { before, after, voxels_removed, voxels_restored, .. } = change;
    let Change { scans_undone, deletions_undone, replayed, renamed_to, .. } = change;
    let renamed_to = renamed_to.as_ref().map(|name| name.as_str());
    let uuid = after.or(*before).map(|version| version.map_uuid.to_string());
    let uuid_before = before.filter(|before| after.is_some_and(|after| after.map_uuid != before.map_uuid));
    let uuid_before = uuid_before.map(|before| before.map_uuid.to_string());
    let revision = |version: &Option<MapVersion>| version.map(|version| version.revision);
    let (revision_before, revision) = (revision(before), revision(after));
    let outcome = if *replayed { "unchanged" } else { "done" };
    tracing::info!(
        target: AUDIT, operation, map, renamed_to, robot, uuid, uuid_before, revision_before, revision, voxels_removed,
        voxels_restored, scans_undone, deletions_undone, outcome, "change"
    );
}

impl Kinds {
    /// Writes the first of a robot's scans that is refused, and the first that is accepted after it.
    fn write_scan(&self, caller: Option<&CallerName>, map: &MapName, scan: &JudgedScan) {
        let JudgedScan { robot, session, scan_id, verdict, refusal, overlap, .. } = scan;
        let (operation, verdict) = ("InsertScan", verdict.as_str());
        let (map_name, robot_name, session) = (map.as_str(), robot.as_str(), session.as_str());
        if let Some(reason) = refusal {
            if let Some(unwritten) = self.refused_robots.refused(caller, map, robot) {
                tracing::info!(
                    target: AUDIT, operation, map = map_name, robot = robot_name, session, scan_id, verdict, overlap,
                    reason, outcome = "refused", unwritten, "scan"
                );
            }
        } else if let Some(row) = self.refused_robots.accepted(caller, map, robot) {
            tracing::info!(
                target: AUDIT, operation, map = map_name, robot = robot_name, session, scan_id,
                scans_refused = row.scans, seconds = row.since.elapsed().as_secs_f64(),
                outcome = "accepted_again", "scan"
            );
        }
    }
}

/// Writes changes of maps, done, failed or left by their callers, and the begin and end of refusals.
impl Observer for Audit {
    fn operation_ended(&self, ended: &Ended<'_>) {
        let Ended { operation, map, end, .. } = ended;
        let map = map.map(|map| map.as_str());
        match end {
            End::Done(Outcome::Changed(change)) | End::DoneUnheard(change) => {
                if let (Some(map), true) = (ended.map, ANOTHER_MAP.contains(operation)) {
                    self.0.refused_robots.forget(map, change.renamed_to.as_ref());
                }
                write_change(operation, map, change, None);
            }
            End::Done(Outcome::Scan(scan)) if !scan.replayed => {
                if let Some(map) = ended.map {
                    self.0.write_scan(ended.caller, map, scan);
                }
                if let JudgedScan { robot, carved: Some(change), .. } = scan {
                    write_change(operation, map, change, Some(robot.as_str()));
                }
            }
            End::Done(_) => {}
            End::Failed(error) if CHANGES.contains(operation) => {
                let reason = error.reason.as_str();
                // Its change may be made, and its map is closed then: there are not many.
                let is_open = error.reason == Reason::OutcomeUnknown;
                if let Some(unwritten) = if is_open { Some(0) } else { self.0.failed.to_write() } {
                    tracing::info!(
                        target: AUDIT, operation, map, outcome = "failed", reason, %error, unwritten, "change"
                    );
                }
            }
            End::CallerGone if CHANGES.contains(operation) => {
                if let Some(unwritten) = self.0.gone.to_write() {
                    tracing::info!(target: AUDIT, operation, map, outcome = "caller_gone", unwritten, "change");
                }
            }
            End::Failed(_) | End::CallerGone => {}
        }
    }
}
