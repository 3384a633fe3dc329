//! The version of a map in JSON.

use serde::Serialize;

use crate::service::MapVersion;

/// Which state of which map an answer speaks of; part of every answer's object.
#[derive(Debug, Serialize)]
pub struct JsonVersion {
    /// The map's revision.
    pub revision: u64,
    /// The uuid of the map's incarnation.
    pub map_uuid: String,
}

impl From<MapVersion> for JsonVersion {
    fn from(version: MapVersion) -> Self {
        Self { revision: version.revision, map_uuid: version.map_uuid.to_string() }
    }
}
