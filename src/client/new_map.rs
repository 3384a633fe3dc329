//! What a caller says of a map to make; the server fills in the rest.

use crate::map::MapName;
use crate::wire::pb;

/// Settings of a map to make; what is none is the server's default.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewMap {
    /// Side of a finest voxel, r_0, meters.
    pub resolution_m: f64,
    /// Number of levels.
    pub levels: Option<u32>,
    /// Hash functions of the filters, k of eq. (1).
    pub filter_hashes: Option<u32>,
    /// Bits of the filters' planes a voxel, m / n of eq. (1).
    pub filter_bits_per_key: Option<f64>,
}

impl NewMap {
    /// A map of `resolution_m`, all else as the server sees fit.
    pub fn of(resolution_m: f64) -> Self {
        Self { resolution_m, levels: None, filter_hashes: None, filter_bits_per_key: None }
    }
}

impl From<(&MapName, NewMap)> for pb::CreateMapRequest {
    fn from((map, new): (&MapName, NewMap)) -> Self {
        let filter = pb::FilterSettings { hashes: new.filter_hashes, bits_per_key: new.filter_bits_per_key };
        let settings =
            pb::MapSettings { resolution_m: new.resolution_m, levels: new.levels, filter: Some(filter) };
        Self { map: map.to_string(), settings: Some(settings) }
    }
}
