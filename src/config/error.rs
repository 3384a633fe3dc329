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
    /// Numbers of a robot's table that make no filter.
    #[error("robots.{name}: {error}")]
    Robot {
        /// Of the table.
        name: String,
        /// What is wrong.
        error: PointFilterError,
    },
}
