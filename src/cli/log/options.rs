//! Options of commands that read logs.

use std::path::{Path, PathBuf};

use mrol::console::{CliError, parse};
use mrol_logs::log::Bag;
use mrol_logs::point_times::TimesOption;
use mrol_logs::sequence::SequenceOptions;
use mrol_logs::survey::Choice;
use mrol_map::geometry::Pose;
use mrol_map::scan::scan_files;

/// What of a log is used, and how.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Options of logs")]
pub(crate) struct LogOptions {
    #[command(flatten)]
    pub(super) sources: SourceOptions,
    /// Added to the stamp of a cloud to have the time of its odometry, seconds
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    time_offset: Option<f64>,
    /// Take clouds from so many seconds after the first on
    #[arg(long, value_name = "SECONDS")]
    from: Option<f64>,
    /// Take clouds up to so many seconds after the first
    #[arg(long, value_name = "SECONDS")]
    to: Option<f64>,
    /// Take every N-th cloud
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
}

/// Which topics and frames of a log are used.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Options of logs")]
pub(super) struct SourceOptions {
    /// Topic of the clouds [default: the one with the most bytes]
    #[arg(long, value_name = "TOPIC")]
    cloud: Option<String>,
    /// Where the motion between clouds is from: a topic of nav_msgs/Odometry, a frame of /tf, or none [default: the
    /// frame odom, else such a topic]
    #[arg(long, value_name = "TOPIC_OR_FRAME")]
    odometry: Option<String>,
    /// How the times of points are read: FIELD:UNIT:FROM, such as t:ns:stamp. Units are s, ms, us and ns; they count
    /// from the stamp, the epoch, or so that the first or the last point is at the stamp [default: found out]
    #[arg(long, value_name = "TIMES")]
    times: Option<TimesOption>,
    /// Where the sensor is on the frame that the odometry tells of, where no transform says it: "x y z qx qy qz qw"
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose)]
    extrinsics: Option<Pose>,
}

/// Largest number of seconds of an option: thirty years.
const SECONDS_MAX: f64 = 1e9;

impl LogOptions {
    /// The log among what a command is given; none where that is scan files.
    ///
    /// # Errors
    /// When there is a log and something else beside it, or an option of logs and no log.
    pub(crate) fn path_among<'a>(&self, paths: &'a [PathBuf]) -> Result<Option<&'a Path>, CliError> {
        match (paths.iter().find(|path| Bag::is_log(path)), self.first_given()) {
            (Some(path), _) if paths.len() > 1 => Err(CliError::usage(format!(
                "{}: a log is taken alone, and {} files or folders are given",
                path.display(),
                paths.len()
            ))),
            (Some(path), _) => match scan_files(std::slice::from_ref(path)) {
                Ok(scans) if path.is_dir() => Err(CliError::usage(format!(
                    "{}: the folder has a log, and {} scan files such as {}: name the files of one of them",
                    path.display(),
                    scans.len(),
                    scans[0].display()
                ))),
                _ => Ok(Some(path)),
            },
            (None, Some(option)) => Err(CliError::usage(format!("{option} is for a log, such as run.mcap"))),
            (None, None) => Ok(None),
        }
    }

    fn first_given(&self) -> Option<&'static str> {
        let Self {
            sources: SourceOptions { cloud, odometry, times, extrinsics },
            time_offset,
            from,
            to,
            every,
        } = self;
        let given = [
            ("--cloud", cloud.is_some()),
            ("--odometry", odometry.is_some()),
            ("--times", times.is_some()),
            ("--extrinsics", extrinsics.is_some()),
            ("--time-offset", time_offset.is_some()),
            ("--from", from.is_some()),
            ("--to", to.is_some()),
            ("--every", every.is_some()),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option)
    }

    /// Which scans are taken, and how they are read.
    ///
    /// # Errors
    /// When a number of seconds is not finite, or too large.
    pub(super) fn sequence(&self) -> Result<SequenceOptions, CliError> {
        let nanoseconds = |option: &str, seconds: Option<f64>, default_ns: i64| match seconds {
            None => Ok(default_ns),
            Some(seconds) if seconds.abs() <= SECONDS_MAX => Ok((seconds * 1e9).round() as i64),
            Some(seconds) => Err(CliError::usage(format!(
                "{option} must be a number of seconds within {SECONDS_MAX}, got {seconds}; --from and --to count from the \
                 first cloud"
            ))),
        };
        let defaults = SequenceOptions::default();
        Ok(SequenceOptions {
            times: self.sources.times.clone(),
            time_offset_ns: nanoseconds("--time-offset", self.time_offset, defaults.time_offset_ns)?,
            extrinsics: self.sources.extrinsics,
            from_ns: nanoseconds("--from", self.from, defaults.from_ns)?,
            to_ns: nanoseconds("--to", self.to, defaults.to_ns)?,
            every: self.every.unwrap_or(defaults.every),
        })
    }
}

impl SourceOptions {
    /// What the user says of the log.
    pub(super) fn choice(&self) -> Choice {
        Choice {
            cloud: self.cloud.clone(),
            odometry: self.odometry.clone(),
            extrinsics: self.extrinsics,
            times: self.times.clone(),
        }
    }
}
