//! Section `maps` of the settings.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Which maps are kept in memory.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapsConfig {
    /// Seconds after which a map that nobody uses or watches is saved and leaves memory; the next request opens it. 0
    /// means never, and is the default.
    pub sleep_after_s: u64,
}

impl MapsConfig {
    /// Time after which a map leaves memory; never where none.
    pub(super) fn sleep_after(&self) -> Option<Duration> {
        (self.sleep_after_s > 0).then(|| Duration::from_secs(self.sleep_after_s))
    }
}
