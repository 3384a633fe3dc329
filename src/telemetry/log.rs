//! The log: one line an event on standard error, for people or for programs.

use std::io::IsTerminal;

use serde::{Deserialize, Serialize};
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

use super::audit::AUDIT;

/// How log lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One object a line, for programs.
    Json,
}

/// Why telemetry could not start.
#[derive(Debug, thiserror::Error)]
pub enum TelemetryError {
    /// The filter is none.
    #[error("log.level must be a level (info) or a filter (info,mrol=debug), got {0:?}: {1}")]
    Level(String, tracing_subscriber::filter::ParseError),
    /// Somebody else writes the log already.
    #[error("the log is started already")]
    Started,
    /// The metrics cannot be kept.
    #[error("metrics cannot be kept: {0}")]
    Metrics(#[from] metrics_exporter_prometheus::BuildError),
}

/// The target of the spans of requests, whose fields (protocol, request id, key, peer) stand in every line within.
pub const REQUEST: &str = "mrol::request";

/// Lines that wait until standard error takes them, at most; further ones are lost.
const LINES_WAITING_MAX: usize = 16_384;

/// The running log. Dropped at the end of the process, it waits a second at most for the last lines to be written.
#[derive(Debug)]
#[must_use = "lines are written while it lives"]
pub struct Logging(#[expect(dead_code, reason = "it works when it is dropped")] WorkerGuard);

/// Starts the process's log at `level`: a level or a list of `target=level`. With `audit` the lines of the
/// [audit](super::audit::AUDIT) are written whatever the level, and without not at all. Lines are written until the
/// result is dropped.
///
/// # Errors
/// When `level` is no filter, or the log was started before.
pub fn start_logging(format: LogFormat, level: &str, audit: bool) -> Result<Logging, TelemetryError> {
    let filter = EnvFilter::try_new(level).map_err(|error| TelemetryError::Level(level.to_owned(), error))?;
    let filter = with_audit(filter, audit);
    let colors = std::io::stderr().is_terminal();
    // On a thread of its own: whoever reads standard error may stop, and must not stop the server.
    let writing = NonBlockingBuilder::default().lossy(true).buffered_lines_limit(LINES_WAITING_MAX);
    let (writer, worker) = writing.thread_name("log").finish(std::io::stderr());
    let lines = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colors).with_writer(writer);
    let started = match format {
        LogFormat::Text => lines.try_init(),
        LogFormat::Json => lines.json().flatten_event(true).try_init(),
    };
    started.map_err(|_| TelemetryError::Started)?;
    Ok(Logging(worker))
}

fn with_audit(filter: EnvFilter, audit: bool) -> EnvFilter {
    let directives = if audit {
        // Without their requests' spans the lines would not say who asked.
        vec![format!("{AUDIT}=info"), format!("{REQUEST}=info")]
    } else {
        vec![format!("{AUDIT}=off")]
    };
    let directives = directives.into_iter().filter_map(|directive| directive.parse().ok());
    directives.fold(filter, EnvFilter::add_directive)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_that_is_none_is_named() {
        let error = start_logging(LogFormat::Text, "mrol=loud", true).unwrap_err();
        assert!(error.to_string().contains("mrol=loud"), "{error}");
    }
}
