//! The filter of maps whose makers do not say.

use serde::{Deserialize, Serialize};

use crate::bloom::FilterSettings;

/// A counting Bloom filter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterConfig {
    /// Hash functions, k of eq. (1).
    pub hashes: u32,
    /// Bits of the plane a voxel, m / n of eq. (1).
    pub bits_per_key: f64,
}

impl Default for FilterConfig {
    fn default() -> Self {
        let FilterSettings { hashes, bits_per_key } = FilterSettings::default();
        Self { hashes, bits_per_key }
    }
}
