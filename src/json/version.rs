//! The version of a map in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use mrol_service::MapVersion;

/// Which state of which map an answer speaks of; part of every answer's object.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Version)]
pub struct JsonVersion {
    /// The map's revision.
    pub revision: u64,
    /// The uuid of the map's incarnation.
    #[schema(format = "uuid")]
    pub map_uuid: String,
    /// Hash of the map's finest voxels, 16 hexadecimal digits: a number of JavaScript has too few bits.
    #[schema(nullable = false, pattern = "^[0-9a-f]{16}$")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub content_hash: Option<String>,
}

impl From<MapVersion> for JsonVersion {
    fn from(version: MapVersion) -> Self {
        Self {
            revision: version.revision,
            map_uuid: version.map_uuid.to_string(),
            content_hash: version.content_hash.map(|hash| hash.to_string()),
        }
    }
}
