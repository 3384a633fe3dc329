//! Settings of a map to create.

use crate::map::MapName;
use crate::wire::pb;

/// Settings of a map to create; the server's default where a field is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewMap {
    /// Side of a finest voxel, r_0, meters.
    pub resolution_m: f64,
    /// Number of levels.
    pub levels: Option<u32>,
    /// Number of hash functions of the filters, k of eq. (1).
    pub filter_hashes: Option<u32>,
    /// Bits of the filters' planes for each voxel, m / n of eq. (1).
    pub filter_bits_per_key: Option<f64>,
}

impl NewMap {
    /// Settings with the side of a finest voxel `resolution_m` (meters), and defaults for all else.
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
