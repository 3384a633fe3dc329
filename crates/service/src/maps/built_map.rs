//! A map on its way into the catalog.

use uuid::Uuid;

use crate::resources::Reservation;
use mrol_map::map::MultiResolutionMap;

/// A map that was built of a file and is kept nowhere yet.
pub(crate) struct BuiltMap {
    pub(crate) uuid: Uuid,
    pub(crate) map: MultiResolutionMap,
    /// Memory for its first snapshot.
    pub(crate) saving: Reservation,
}
