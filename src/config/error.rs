//! Errors of the settings.

use mrol_map::map::NameError;
use mrol_map::mapping::{CarvingSettingsError, OdometrySettingsError};
use mrol_map::scan::PointFilterError;
use std::path::PathBuf;

/// Why the settings are not valid.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// An unknown setting or a value of the wrong type; the message names both and their source.
    #[error("{0}")]
    Value(String),
    /// The settings file that the command line names cannot be read.
    #[error("configuration file {} cannot be read: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why, in the system's words.
        problem: String,
    },
    /// A setting that was renamed since an earlier version.
    #[error("{old} is called {new} now")]
    Renamed {
        /// The setting that was given.
        old: &'static str,
        /// The setting's present name.
        new: &'static str,
    },
    /// A value out of its range.
    #[error("{key} must be {range}, got {value}")]
    Range {
        /// The setting.
        key: &'static str,
        /// The range, as text.
        range: String,
        /// The value that was given.
        value: String,
    },
    /// A setting is missing that another one needs.
    #[error("{needed} is missing: {by} is of no use without it")]
    Missing {
        /// The missing setting.
        needed: &'static str,
        /// The setting that needs it.
        by: &'static str,
    },
    /// Two settings contradict each other.
    #[error("{one} and {other} contradict each other: set one of them")]
    Contradiction {
        /// One of the two settings.
        one: &'static str,
        /// The setting that contradicts it.
        other: &'static str,
    },
    /// A misspelled environment variable.
    #[error(
        "variable {name} is no setting: a section and its setting are joined by two underscores, {meant}"
    )]
    Variable {
        /// The variable as it was given.
        name: String,
        /// The variable with the right spelling.
        meant: String,
    },
    /// A table of a robot that no robot can have.
    #[error(
        "robots.{name:?}: {error}; `[robots.\"*\"]` is for all robots that have no table, and no other pattern counts"
    )]
    RobotName {
        /// The name of the table.
        name: String,
        /// What is wrong with it.
        error: NameError,
    },
    /// The point filter of a robot is not valid.
    #[error("robots.{name}: {error}")]
    Robot {
        /// The name of the robot's table.
        name: String,
        /// What is wrong with the filter.
        error: PointFilterError,
    },
    /// What the scans of a robot are to carve is not valid.
    #[error("robots.{name}: {error}")]
    RobotCarving {
        /// The name of the robot's table.
        name: String,
        /// What is wrong with it.
        error: CarvingSettingsError,
    },
    /// How far off the odometry of a robot is is not valid.
    #[error("robots.{name}: {error}")]
    RobotOdometry {
        /// The name of the robot's table.
        name: String,
        /// What is wrong with it.
        error: OdometrySettingsError,
    },
}
