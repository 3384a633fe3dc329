//! Section `log` of the settings.

use serde::{Deserialize, Serialize};

use crate::telemetry::LogFormat;

/// Settings of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LogConfig {
    /// Format of log lines: `text` or `json`.
    pub format: LogFormat,
    /// Least level of log lines, or a list of `target=level`. `info`.
    pub level: String,
    /// Whether changes and refused keys are written to the log, whatever the level. True.
    pub audit: bool,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self { format: LogFormat::Text, level: "info".into(), audit: true }
    }
}
