//! Section `maps` of the settings.

use std::time::Duration;

use mrol_service::section;

/// The largest number of seconds and of MiB.
const MANY: u32 = 1 << 20;

section! {
    /// Which maps are kept in memory.
    pub struct MapsConfig in "maps" {
        /// Time after which a map that nobody uses or watches is saved and leaves memory; the next request opens it. 0
        /// = never.
        sleep_after_s: u64 = 0; s, from 0, to MANY;
    }
}

impl MapsConfig {
    /// Time after which a map leaves memory; never where none.
    pub(super) fn sleep_after(&self) -> Option<Duration> {
        (self.sleep_after_s > 0).then(|| Duration::from_secs(self.sleep_after_s))
    }
}
