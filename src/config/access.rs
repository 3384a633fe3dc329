//! Who may do what.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Who may do what. Keys stand in a file of their own, so that settings can be shown to anybody.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AccessConfig {
    /// The file of keys, which is read again when it changes; without one, whoever can connect may do everything.
    pub keys_file: Option<PathBuf>,
    /// Listen off this machine's loopback without keys all the same. false.
    pub open: bool,
    /// Answer `/metrics` without a key. false.
    pub open_metrics: bool,
}
