//! A whole map at one revision.

use uuid::Uuid;

use mrol_map::map::{MapContents, MapSettings, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// A map at one revision.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// The uuid of this incarnation of the map.
    pub uuid: Uuid,
    /// Settings of the map.
    pub settings: MapSettings,
    /// Contents of the map.
    pub contents: MapContents,
}

impl Snapshot {
    /// Takes a snapshot of `map`, at one revision.
    pub fn of(map: &MultiResolutionMap, uuid: Uuid) -> Self {
        Self { uuid, settings: *map.settings(), contents: map.contents() }
    }

    /// [`Snapshot::of`] under a stop signal; none once stopped.
    pub fn of_until(map: &MultiResolutionMap, uuid: Uuid, stop: StopSignal<'_>) -> Option<Self> {
        Some(Self { uuid, settings: *map.settings(), contents: map.contents_until(stop)? })
    }

    /// Builds the map from the snapshot.
    ///
    /// # Errors
    /// When its settings are out of range.
    pub fn restore(self) -> Result<MultiResolutionMap, mrol_map::map::MapSettingsError> {
        MultiResolutionMap::restore(self.settings, self.contents)
    }
}
