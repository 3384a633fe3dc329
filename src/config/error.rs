//! Why there is no configuration.

use std::path::PathBuf;

use crate::scan::PointFilterError;

/// Why there is no configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A key that is none, or a value that does not fit; the message names both and where they stand.
    #[error("{0}")]
    Value(Box<figment::Error>),
    /// The file named on the command line is not there.
    #[error("configuration file {} cannot be read", .0.display())]
    File(PathBuf),
    /// A setting that has another name since an earlier version.
    #[error("{old} is called {new} now")]
    Renamed {
        /// The setting that was given.
        old: &'static str,
        /// The setting's name of today.
        new: &'static str,
    },
    /// A number out of its range.
    #[error("{key} must be {range}, got {value}")]
    Range {
        /// The setting.
        key: &'static str,
        /// What it may be.
        range: &'static str,
        /// What it is.
        value: String,
    },
    /// A setting that another one needs.
    #[error("{needed} is missing: {by} is of no use without it")]
    Missing {
        /// The setting that is not there.
        needed: &'static str,
        /// The one that is.
        by: &'static str,
    },
    /// Two settings that mean opposite things.
    #[error("{one} and {other} contradict each other: set one of them")]
    Contradiction {
        /// The one.
        one: &'static str,
        /// The setting that it contradicts.
        other: &'static str,
    },
    /// A variable that would be a setting if it were spelled otherwise.
    #[error(
        "variable {name} is no setting: a section and its setting are joined by two underscores, {meant}"
    )]
    Variable {
        /// As it is.
        name: String,
        /// As it must be.
        meant: String,
    },
    /// Numbers of a robot's table that make no filter.
    #[error("robots.{name}: {error}")]
    Robot {
        /// The name of the table.
        name: String,
        /// What is wrong.
        error: PointFilterError,
    },
}
