//! A map that is made again: is it the one that is there?

use std::sync::Arc;

use super::hosted_map::HostedMap;
use crate::error::{Reason, ServiceError};
use mrol_map::bloom::FilterSettings;
use mrol_map::map::MapSettings;

/// Making a map again as it is changes nothing; as another it is a conflict.
pub(crate) fn same_settings(
    map: Arc<HostedMap>,
    settings: MapSettings,
) -> Result<Arc<HostedMap>, ServiceError> {
    let there = map.map.settings();
    if *there == settings {
        return Ok(map);
    }
    let (there, wanted) = (description(there), description(&settings));
    let message = format!("map {} exists with {there}, not with {wanted}", map.name);
    Err(ServiceError::new(Reason::MapExists, message))
}

/// All settings of a map as text.
fn description(settings: &MapSettings) -> String {
    let MapSettings { resolution_m, levels, filter, moments, origin } = settings;
    let filter = filter.map_or("no filter".to_owned(), |FilterSettings { hashes, bits_per_key }| {
        format!("filter_hashes {hashes}, filter_bits_per_key {bits_per_key}")
    });
    let moments = if *moments { "moments" } else { "no moments" };
    let origin = origin.map_or(String::new(), |origin| format!(", origin_m {:?}", origin.position_m));
    format!("resolution_m {resolution_m}, levels {levels}, {filter}, {moments}{origin}")
}
