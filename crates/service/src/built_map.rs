//! A map on its way into the catalog.

use uuid::Uuid;

use super::resource_budget::Reservation;
use mrol_map::map::MultiResolutionMap;

/// A map that was built of a file and is kept nowhere yet.
pub(super) struct BuiltMap {
    pub(super) uuid: Uuid,
    pub(super) map: MultiResolutionMap,
    /// Memory for its first snapshot.
    pub(super) saving: Reservation,
}
