//! Scans on their way to the server: over one call, and over the next where that broke.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::attempts::{Attempts, is_passing};
use super::plan::Plan;
use super::report::{FailedLine, ScanLine};
use crate::cli::scan_report::{name_of, name_width};
use mrol::console::{CliError, Output};
use mrol_client::{Client, ClientError};
use mrol_map::map::MapName;

/// Scans read ahead of the one that is being sent.
pub(super) const SCANS_AHEAD: usize = 2;

/// Numbers of scans that the server answered.
#[derive(Default, Clone, Copy)]
pub(super) struct Answers {
    /// All of them.
    pub(super) answered: usize,
    /// Those that failed, and have no verdict.
    pub(super) failed: usize,
    /// Those that are not in the map because their verdict is not `accepted`.
    pub(super) refused: usize,
}

impl Answers {
    /// Whether the command did what it should.
    ///
    /// # Errors
    /// When scans failed, or were not accepted.
    pub(super) fn result(self) -> Result<(), CliError> {
        let Self { answered, failed, refused } = self;
        match failed {
            0 => CliError::unless_accepted(refused, answered),
            _ => Err(CliError::failed(format!(
                "{failed} of {answered} scans failed; the others were answered"
            ))),
        }
    }
}

/// The files of scans on their way.
pub(super) struct Sending<'a> {
    pub(super) client: &'a Client,
    pub(super) map: &'a MapName,
    pub(super) files: &'a [PathBuf],
    pub(super) plan: Arc<Plan>,
    pub(super) output: &'a Output,
    pub(super) counted: Answers,
}

/// Why the scans after one were not answered.
enum Stopped {
    /// What may be over soon.
    ForNow(ClientError),
    ForGood(CliError),
}

impl From<CliError> for Stopped {
    fn from(error: CliError) -> Self {
        Self::ForGood(error)
    }
}

impl Sending<'_> {
    /// Sends all scans, and prints a line for each answer. Where the connection breaks, scans that were not answered
    /// are sent again, under the same numbers, until that failed for `patience`.
    pub(super) async fn run(mut self, patience: Duration) -> Result<Answers, CliError> {
        let mut attempts = Attempts::new(patience);
        loop {
            let before = self.counted.answered;
            let error = match self.send_rest().await {
                Ok(()) => return Ok(self.counted),
                Err(Stopped::ForGood(error)) => return Err(error),
                Err(Stopped::ForNow(error)) => error,
            };
            if self.counted.answered > before {
                attempts.succeeded();
            }
            if attempts.is_first() {
                self.output.note(format!("{error}; going on with {} once that is possible", self.name()));
            }
            if !attempts.pause().await {
                self.output.clear_bar();
                return Err(self.not_answered(&error));
            }
        }
    }

    /// Sends the scans that were not answered yet over one call.
    async fn send_rest(&mut self) -> Result<(), Stopped> {
        let (sender, scans) = mpsc::channel(SCANS_AHEAD);
        let (plan, files, from) = (Arc::clone(&self.plan), self.files.to_vec(), self.counted.answered);
        let reader = tokio::task::spawn_blocking(move || plan.send(&files, from, &sender));
        let answered = self.print_answers(ReceiverStream::new(scans)).await;
        // The call has ended, and nobody receives what the reader sends any more.
        let read = reader.await.map_err(CliError::failed)?;
        answered?;
        Ok(read?)
    }

    async fn print_answers(
        &mut self,
        scans: ReceiverStream<mrol_service::ScanRequest>,
    ) -> Result<(), Stopped> {
        let width = name_width(self.files);
        let mut answers = self.client.insert_scans(self.map, scans).await.map_err(|e| self.stopped(e))?;
        while let Some(answer) = answers.next().await {
            if self.counted.answered == 0 && answer.is_ok() {
                self.output.say(ScanLine::head(width))?;
            }
            match answer {
                Ok(answer) => {
                    self.output.print(&ScanLine::of(self.name(), &answer, width))?;
                    self.counted.refused += usize::from(!answer.accepted);
                }
                Err(error @ ClientError::Refused { .. }) if !is_passing(&error) && !concerns_all(&error) => {
                    self.output.print(&FailedLine { scan: self.name(), error: error.to_string() })?;
                    self.counted.failed += 1;
                }
                Err(error) => return Err(self.stopped(error)),
            }
            self.output.step();
            self.counted.answered += 1;
        }
        Ok(())
    }

    /// The name of the first scan that was not answered.
    fn name(&self) -> String {
        self.files.get(self.counted.answered).map(|file| name_of(file)).unwrap_or_default()
    }

    fn stopped(&self, error: ClientError) -> Stopped {
        if is_passing(&error) {
            return Stopped::ForNow(error);
        }
        // The map was there, and its settings fit.
        if self.counted.answered > 0 {
            return Stopped::ForGood(self.not_answered(&error));
        }
        let advice = advice(&error);
        Stopped::ForGood(CliError::failed(format!("{}: {error}{advice}", self.name())))
    }

    fn not_answered(&self, error: &ClientError) -> CliError {
        CliError::failed(format!(
            "{}: {error}; {} of {} scans were answered. The same command with {} goes on, and adds no scan twice",
            self.name(),
            self.counted.answered,
            self.files.len(),
            self.plan.repeat_with()
        ))
    }
}

/// What helps against a failure.
pub(super) fn advice(error: &ClientError) -> &'static str {
    match error.reason() {
        Some("guess_required") => "; --guess says where the first scan was taken",
        Some("map_not_found") => "; --create --resolution METERS makes it",
        _ => "",
    }
}

/// True of a failure that all scans after it would share.
pub(super) fn concerns_all(error: &ClientError) -> bool {
    matches!(
        error.reason(),
        Some("guess_required" | "map_not_found" | "map_not_allowed" | "robot_not_allowed")
    )
}
