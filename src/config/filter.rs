//! Section `filter` of the settings: the filters of new maps whose requests do not say.

use serde::{Deserialize, Serialize};

use mrol_map::bloom::FilterSettings;

/// Settings of the counting Bloom filters of new maps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterConfig {
    /// Number of hash functions, k of eq. (1).
    pub hashes: u32,
    /// Bits of the filter's plane for each voxel, m / n of eq. (1).
    pub bits_per_key: f64,
}

impl Default for FilterConfig {
    fn default() -> Self {
        let FilterSettings { hashes, bits_per_key } = FilterSettings::default();
        Self { hashes, bits_per_key }
    }
}
