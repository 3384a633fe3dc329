//! The version of a map that an answer speaks of.

use uuid::Uuid;

/// Which state of which map an answer speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapVersion {
    /// Committed changes so far.
    pub revision: u64,
    /// The uuid of this incarnation of the map.
    pub map_uuid: Uuid,
}
