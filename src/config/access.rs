//! Section `access` of the settings.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::error::ConfigError;
use crate::access::is_host;

/// Settings of access: which keys are valid, and who needs none. Keys are in a file of their own, so that the settings
/// can be shown to anybody.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AccessConfig {
    /// Path of the file of keys, which is read again when it changes. Without it, whoever can connect may do
    /// everything.
    pub keys_file: Option<PathBuf>,
    /// Allows listening beyond loopback without keys; not together with `keys_file`. False.
    pub open: bool,
    /// Answers `/metrics` without a key. False.
    pub open_metrics: bool,
    /// Host names and addresses, without ports, that a server without keys accepts besides `localhost`, loopback
    /// addresses and the address that was connected to. Empty.
    pub hosts: Vec<String>,
    /// Number of days before a key expires from which on the log warns of it once a day; 0 to 3650. 14.
    pub expiry_warning_days: u32,
}

/// Most days before an expiry from which on it may be warned of.
pub(super) const WARNING_DAYS_MAX: u32 = 3650;

impl Default for AccessConfig {
    fn default() -> Self {
        Self { keys_file: None, open: false, open_metrics: false, hosts: Vec::new(), expiry_warning_days: 14 }
    }
}

impl AccessConfig {
    /// Time before a key expires from which on it is warned of.
    pub fn expiry_warning(&self) -> Duration {
        days(self.expiry_warning_days)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        if self.open && self.keys_file.is_some() {
            return Err(ConfigError::Contradiction { one: "access.open", other: "access.keys_file" });
        }
        if let Some(host) = self.hosts.iter().find(|host| !is_host(host)) {
            let range = "names or addresses without ports";
            return Err(ConfigError::Range { key: "access.hosts", range, value: format!("{host:?}") });
        }
        check_warning("access.expiry_warning_days", self.expiry_warning_days)
    }
}

pub(super) fn check_warning(key: &'static str, days: u32) -> Result<(), ConfigError> {
    if days > WARNING_DAYS_MAX {
        return Err(ConfigError::Range { key, range: "0 to 3650", value: days.to_string() });
    }
    Ok(())
}

pub(super) fn days(days: u32) -> Duration {
    Duration::from_secs(u64::from(days) * 24 * 3600)
}
