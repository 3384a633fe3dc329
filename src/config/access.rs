//! Who may do what.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::ConfigError;
use crate::access::is_host;

/// Who may do what. Keys stand in a file of their own, so that settings can be shown to anybody.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AccessConfig {
    /// The file of keys, which is read again when it changes; without one, whoever can connect may do everything.
    pub keys_file: Option<PathBuf>,
    /// Listen off this machine's loopback without keys all the same; not together with `keys_file`. false.
    pub open: bool,
    /// Answer `/metrics` without a key. false.
    pub open_metrics: bool,
    /// Names and addresses, without ports, that a server without keys answers to besides `localhost`, loopback
    /// addresses and the address that was connected to; none.
    pub hosts: Vec<String>,
    /// Days before a key expires from which on the log says so, once a day; 0 to 3650. 14.
    pub expiry_warning_days: u32,
}

/// Days before an expiry from which on it is warned of, at most.
pub(super) const WARNING_DAYS_MAX: u32 = 3650;

impl Default for AccessConfig {
    fn default() -> Self {
        Self { keys_file: None, open: false, open_metrics: false, hosts: Vec::new(), expiry_warning_days: 14 }
    }
}

impl AccessConfig {
    /// How long before a key expires it is warned of.
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
