//! What a map is made with.

use super::origin::{MapOrigin, MapOriginError};
use crate::bloom::{FilterSettings, FilterSettingsError};
use crate::voxel::{Lattice, SettingError};

/// Settings of a map, fixed for its life.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSettings {
    /// Side of a finest voxel, r_0, meters.
    pub resolution_m: f64,
    /// Number of levels; level n has r_n = r_0 * 2^n.
    pub levels: u32,
    /// The counting Bloom filter in front of each level; without one the exact set answers every look-up.
    pub filter: Option<FilterSettings>,
    /// The map keeps the moments of its points, which alignments are refined on. Without them the ascent on overlap
    /// alone finds poses.
    pub moments: bool,
    /// Where the map's frame lies in that of a survey; none where nobody said.
    pub origin: Option<MapOrigin>,
}

/// Levels of a map where its maker does not say: voxels up to 32 r_0, so that an alignment finds its way from 1 m and
/// 20 degrees off at r_0 = 0.04 m. (The paper takes 4 and steps of a few centimeters, III-B.)
pub const LEVELS_DEFAULT: u32 = 6;

/// Why settings cannot make a map.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MapSettingsError {
    /// An error in the settings of the lattice.
    #[error(transparent)]
    Lattice(#[from] SettingError),
    /// An error in the settings of the filter.
    #[error(transparent)]
    Filter(#[from] FilterSettingsError),
    /// An error in the origin.
    #[error(transparent)]
    Origin(#[from] MapOriginError),
}

impl MapSettings {
    /// Settings of a map of `resolution_m` with `levels` levels, the default filter, and moments.
    pub fn new(resolution_m: f64, levels: u32) -> Self {
        Self { resolution_m, levels, filter: Some(FilterSettings::default()), moments: true, origin: None }
    }

    /// Settings of a map of `resolution_m` with `levels` levels that keeps its exact set alone, for queries: about a
    /// twentieth of the memory of a map with filters and moments.
    pub fn query_only(resolution_m: f64, levels: u32) -> Self {
        Self { filter: None, moments: false, ..Self::new(resolution_m, levels) }
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// Names the number out of range and the range.
    pub fn checked(self) -> Result<Self, MapSettingsError> {
        self.lattice().map(|_| self)
    }

    pub(super) fn lattice(&self) -> Result<Lattice, MapSettingsError> {
        self.filter.map(FilterSettings::checked).transpose()?;
        self.origin.map(|origin| MapOrigin::new(origin.position_m)).transpose()?;
        Ok(Lattice::new(self.resolution_m, self.levels)?)
    }
}
