//! Section `log` of the settings.

use mrol_service::{SettingKind, SettingValue, section};

use crate::telemetry::LogFormat;

section! {
    /// Settings of the log.
    pub struct LogConfig in "log" {
        /// Format of log lines: `text` or `json`.
        format: LogFormat = LogFormat::Text; none;
        /// Least level of log lines, or a list of `target=level`.
        level: String = "info".into(); none;
        /// Write changes and refused keys to the log, whatever its level.
        audit: bool = true; none;
    }
}

impl SettingValue for LogFormat {
    const KIND: SettingKind = SettingKind::Text;

    fn words() -> Vec<&'static str> {
        vec!["text", "json"]
    }
}
