//! The version of a map that an answer speaks of.

use uuid::Uuid;

use mrol_map::map::ContentHash;

/// Which state of which map an answer speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapVersion {
    /// Committed changes so far.
    pub revision: u64,
    /// The uuid of this incarnation of the map.
    pub map_uuid: Uuid,
    /// Hash of the finest voxels that the map holds in this state; none in an answer that is given again, of which the
    /// map has moved on since.
    pub content_hash: Option<ContentHash>,
}
