//! A log's file, and its scans one by one.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use super::options::{LogOptions, SourceOptions};
use mrol::console::{CliError, Output};
use mrol_logs::log::{Bag, Messages};
use mrol_logs::sequence::{LoggedScan, Sequence, SequenceOptions};
use mrol_logs::survey::{LogSurvey, Plan};

/// Bytes of the file from one step of the progress bar to the next.
const STEP_BYTES: u64 = 1 << 20;

/// A log that was surveyed.
pub(crate) struct LogFile {
    path: PathBuf,
    /// Bytes of the file.
    pub(crate) bytes: u64,
    pub(super) survey: LogSurvey,
}

impl LogFile {
    /// Reads a log to its end to see what it has.
    ///
    /// # Errors
    /// When it cannot be read, or is no log.
    pub(super) fn survey(path: &Path, output: &Output) -> Result<Self, CliError> {
        let mut bag = Bag::open(path).map_err(|error| in_file(path, error))?;
        let bytes = bag.bytes();
        let output = output.clone().with_bar_of_bytes(bytes);
        let mut shown = 0;
        let survey = LogSurvey::take(&mut bag, |read| {
            if read >= shown + STEP_BYTES {
                shown = read;
                output.advance_to(read);
            }
        });
        output.clear_bar();
        Ok(Self { path: path.to_owned(), bytes, survey: survey.map_err(|error| in_file(path, error))? })
    }

    /// What of it is used.
    ///
    /// # Errors
    /// When it has no clouds, or not what the options ask for.
    pub(super) fn plan(&self, options: &SourceOptions) -> Result<Plan, CliError> {
        Plan::of(&self.survey, &options.choice()).map_err(|error| in_file(&self.path, error))
    }

    /// Surveys a log, says what of it is used and what is missing, and returns its scans.
    ///
    /// # Errors
    /// When it cannot be read, has no clouds, or not what the options ask for.
    pub(crate) fn open(
        path: &Path,
        options: &LogOptions,
        output: &Output,
    ) -> Result<(Self, LogScans), CliError> {
        let sequence = options.sequence()?;
        let file = Self::survey(path, output)?;
        let plan = file.plan(&options.sources)?;
        for used in &plan.uses {
            output.say(format!("{}: {} ({})", used.purpose, used.source, used.why))?;
        }
        plan.missing.iter().for_each(|missing| output.note(missing));
        file.survey.oddities().for_each(|oddity| output.note(oddity));
        for damage in &file.survey.damages {
            output.note(damage);
        }
        let scans = LogScans::new(&file, plan, sequence)?;
        Ok((file, scans))
    }

    /// A name of this log's scans that another log hardly has, and a copy of it has: of the topic, its first stamp and
    /// its first message.
    pub(crate) fn session(&self, scans: &LogScans) -> String {
        let summary = &self.survey.topics[scans.cloud];
        let topic: String = summary.topic.name.chars().filter(char::is_ascii_alphanumeric).take(20).collect();
        let (stamp_ns, checksum) = (summary.first_stamp_ns, summary.first_checksum);
        format!("log-{topic}-{}-{:08x}", stamp_ns.unwrap_or_default(), checksum.unwrap_or_default())
    }
}

/// The scans of a log, read one by one.
pub(crate) struct LogScans {
    path: PathBuf,
    bag: Bag,
    sequence: Sequence,
    /// Number of the topic of clouds.
    cloud: usize,
    ready: VecDeque<LoggedScan>,
    is_over: bool,
}

impl LogScans {
    fn new(file: &LogFile, plan: Plan, options: SequenceOptions) -> Result<Self, CliError> {
        Ok(Self {
            path: file.path.clone(),
            bag: Bag::open(&file.path).map_err(|error| in_file(&file.path, error))?,
            cloud: plan.cloud,
            sequence: Sequence::new(&file.survey, plan, options),
            ready: VecDeque::new(),
            is_over: false,
        })
    }

    /// The next scan, and up to which byte the log was read for it; none at the end. Notes what is odd, once.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn next(&mut self, output: &Output) -> Result<Option<(LoggedScan, u64)>, CliError> {
        while self.ready.is_empty() && !self.is_over {
            match self.bag.next_message().map_err(|error| in_file(&self.path, error))? {
                Some(message) => self.sequence.take(&message),
                None => self.is_over = true,
            }
            while let Some(scan) = self.sequence.next_scan(self.is_over) {
                self.ready.push_back(scan);
            }
            self.sequence.notes().into_iter().for_each(|note| output.note(note));
            if self.is_over {
                self.sequence.totals().into_iter().for_each(|total| output.note(total));
            }
        }
        Ok(self.ready.pop_front().map(|scan| (scan, self.bag.position())))
    }
}

/// The name of a scan, for a column: its stamp in seconds.
pub(crate) fn name_of_stamp(stamp_ns: i64) -> String {
    let (sign, ns) = (if stamp_ns < 0 { "-" } else { "" }, stamp_ns.unsigned_abs());
    format!("{sign}{}.{:03}", ns / 1_000_000_000, ns % 1_000_000_000 / 1_000_000)
}

fn in_file(path: &Path, problem: impl std::fmt::Display) -> CliError {
    CliError::failed(format!("{}: {problem}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::name_of_stamp;

    #[test]
    fn a_stamp_is_named_in_seconds_before_1970_too() {
        for (stamp_ns, name) in [(1_500_000_000, "1.500"), (0, "0.000"), (-4_800_000_000, "-4.800")] {
            assert_eq!(name_of_stamp(stamp_ns), name);
        }
    }
}
