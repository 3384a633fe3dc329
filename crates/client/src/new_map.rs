//! Settings of a map to create.

use crate::wire::pb;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{MapName, MapOrigin};

/// Settings of a map to create; the server's default where a field is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewMap {
    /// Side of a finest voxel, r_0, meters.
    pub resolution_m: f64,
    /// Number of levels.
    pub levels: Option<u32>,
    /// The counting Bloom filters in front of the levels.
    pub filter: NewFilter,
    /// The map keeps the moments of its points, which alignments are refined on. True where none.
    pub moments: Option<bool>,
    /// Where the map's frame lies in that of a survey.
    pub origin: Option<MapOrigin>,
}

/// Filters of a map to create.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NewFilter {
    /// Filters; the server's default where a field is none.
    Filter {
        /// Number of hash functions, k of eq. (1).
        hashes: Option<u32>,
        /// Bits of the planes for each voxel, m / n of eq. (1).
        bits_per_key: Option<f64>,
    },
    /// No filters: the exact set answers every look-up.
    NoFilter,
}

impl Default for NewFilter {
    /// The server's default filters.
    fn default() -> Self {
        Self::Filter { hashes: None, bits_per_key: None }
    }
}

impl From<Option<FilterSettings>> for NewFilter {
    fn from(filter: Option<FilterSettings>) -> Self {
        let given = |FilterSettings { hashes, bits_per_key }| Self::Filter {
            hashes: Some(hashes),
            bits_per_key: Some(bits_per_key),
        };
        filter.map_or(Self::NoFilter, given)
    }
}

impl NewMap {
    /// Settings with the side of a finest voxel `resolution_m` (meters), and defaults for all else.
    pub fn of(resolution_m: f64) -> Self {
        Self { resolution_m, levels: None, filter: NewFilter::default(), moments: None, origin: None }
    }
}

impl From<(&MapName, NewMap)> for pb::CreateMapRequest {
    fn from((map, new): (&MapName, NewMap)) -> Self {
        let NewMap { resolution_m, levels, filter, moments, origin } = new;
        let origin_m = origin.map(|origin| origin.position_m.into());
        let filter = match filter {
            NewFilter::Filter { hashes, bits_per_key } => Some(pb::FilterSettings { hashes, bits_per_key }),
            NewFilter::NoFilter => None,
        };
        let no_filter = filter.is_none();
        let settings = pb::MapSettings { resolution_m, levels, filter, no_filter, moments, origin_m };
        Self { map: map.to_string(), settings: Some(settings) }
    }
}
