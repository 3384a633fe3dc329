//! `mrol events`: tells what became of the scans that robots sent.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;
use time::OffsetDateTime;
use time::format_description;

use super::remote::MapOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::json::{JsonEvent, JsonScan};
use mrol_map::align::Verdict;
use mrol_map::map::RobotName;
use mrol_service::{EventMessage, EventsQuery, ScanEvent};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol events --map office                     the last scans, the oldest first: accepted, refused, failed
  mrol events --map office --robot r1 --not-accepted
  mrol events --map office --follow            and each as it comes, until interrupted
  mrol --json events --map office | jq -r 'select(.error) | .error.detail'

The server keeps the last `limits.events_per_map_max` in memory, and of a robot that fell silent the last one; a
restart forgets them. Times are UTC.";

/// Tell what became of the last scans that robots sent to a map on a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Events {
    #[command(flatten)]
    map: MapOptions,
    /// Of this robot alone
    #[arg(long)]
    robot: Option<String>,
    /// Only scans that do not fit, taken by force or not, and requests that failed
    #[arg(long)]
    not_accepted: bool,
    /// Go on with each event as it comes
    #[arg(long)]
    follow: bool,
}

impl Events {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let robot = self.robot.as_deref().map(RobotName::new).transpose().map_err(CliError::failed)?;
        let query = EventsQuery { since_number: 0, robot };
        let client = self.map.server.connect().await?;
        if !self.follow {
            let events = client.list_events(&self.map.name, query).await?;
            return events.iter().try_for_each(|event| self.print(&output, event));
        }
        let mut messages = client.watch_events(&self.map.name, query).await?;
        while let Some(message) = messages.next().await {
            if let EventMessage::Event(event) = message? {
                self.print(&output, &event)?;
            }
        }
        Ok(())
    }

    fn print(&self, output: &Output, event: &ScanEvent) -> Result<(), CliError> {
        let fits =
            event.answer.as_ref().is_ok_and(|answer| answer.accepted && answer.verdict == Verdict::Accepted);
        if self.not_accepted && fits {
            return Ok(());
        }
        output.print(&Line(event.into()))
    }
}

/// An event, to be printed.
#[derive(Serialize)]
#[serde(transparent)]
struct Line(JsonEvent);

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let JsonEvent { time_ms, robot, session, scan_id, duration_ms, answer, error, .. } = &self.0;
        write!(f, "{} {robot}", timestamp(*time_ms))?;
        if let Some(scan_id) = scan_id {
            write!(f, " scan {scan_id}")?;
        }
        if !session.is_empty() {
            write!(f, " of session {session}")?;
        }
        match (answer, error) {
            (Some(answer), _) => write_answer(f, answer)?,
            (None, Some(error)) => write!(f, ": failed ({}): {}", error.reason, error.detail)?,
            (None, None) => {}
        }
        write!(f, ", {duration_ms:.0} ms")
    }
}

fn write_answer(f: &mut fmt::Formatter<'_>, answer: &JsonScan) -> fmt::Result {
    let forced =
        if answer.accepted && answer.verdict != Verdict::Accepted.as_str() { "forced, " } else { "" };
    write!(f, ": {forced}{}, overlap {:.2}", answer.verdict, answer.overlap)?;
    if let Some(how) = answer.recovered {
        write!(f, ", found again by {how}")?;
    }
    match (answer.accepted, answer.replayed, answer.stationary) {
        (true, true, _) => write!(f, ", was there already"),
        (true, _, true) => write!(f, ", stands still"),
        (true, ..) => {
            let (new, revision) = (count(answer.new_voxels), answer.version.revision);
            write!(f, ", {new} new voxels, revision {revision}")
        }
        (false, ..) => write!(f, ", {}", answer.reason),
    }
}

/// A time as RFC 3339 has it, in UTC, with all its milliseconds.
fn timestamp(unix_ms: f64) -> String {
    const FORM: &str = "[year]-[month]-[day]T[hour]:[minute]:[second].[subsecond digits:3]Z";
    let time = OffsetDateTime::from_unix_timestamp_nanos(i128::from(unix_ms as i64) * 1_000_000);
    let form = format_description::parse_borrowed::<2>(FORM);
    time.ok().zip(form.ok()).and_then(|(time, form)| time.format(&form).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timestamp_has_all_its_digits() {
        assert_eq!(timestamp(1_764_086_399_100.0), "2025-11-25T15:59:59.100Z");
    }
}
