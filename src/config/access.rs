//! Section `access` of the settings.

use std::path::PathBuf;
use std::time::Duration;

use super::error::ConfigError;
use crate::access::is_host;
use mrol_service::section;

section! {
    /// Settings of access: which keys are valid, and who needs none. Keys are in a file of their own, so that the
    /// settings can be shown to anybody.
    pub struct AccessConfig in "access" {
        /// Path of the file of keys, which is read again when it changes. Without it, whoever can connect may do
        /// everything.
        keys_file: Option<PathBuf> = None; none;
        /// Listen beyond loopback without keys; not together with `keys_file`.
        open: bool = false; none;
        /// Answer `/metrics` without a key.
        open_metrics: bool = false; none;
        /// Host names and addresses, without ports, that a server without keys answers to besides `localhost`, loopback
        /// addresses and the address that was connected to.
        hosts: Vec<String> = Vec::new(); none;
        /// How long before a key expires the log warns of it, once a day.
        expiry_warning_days: u32 = 14; days, from 0, to WARNING_DAYS_MAX;
    }
}

/// Most days before an expiry from which on it may be warned of.
pub(super) const WARNING_DAYS_MAX: u32 = 3650;

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
            let range = "names or addresses without ports".into();
            return Err(ConfigError::Range { key: "access.hosts", range, value: format!("{host:?}") });
        }
        Ok(())
    }
}

pub(super) fn days(days: u32) -> Duration {
    Duration::from_secs(u64::from(days) * 24 * 3600)
}
