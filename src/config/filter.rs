//! Section `filter` of the settings: the filters of new maps whose requests do not say.

use mrol_map::bloom::FilterSettings;
use mrol_service::section;

section! {
    /// Settings of the counting Bloom filters of new maps.
    pub struct FilterConfig in "filter" {
        /// Hash functions of the filters of maps whose makers do not say, k of eq. (1).
        hashes: u32 = FilterSettings::default().hashes; none, from 1, to 10;
        /// Bits of their planes a voxel, just before growth, m / n of eq. (1).
        bits_per_key: f64 = FilterSettings::default().bits_per_key; none, from 1, to 4096;
    }
}
