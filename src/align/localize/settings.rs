//! The constants of the search, by name.

/// Settings of [`super::localize`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalizationSettings {
    /// Points of the scan that bound a cell of poses. 300.
    pub search_points: usize,
    /// Finest voxels of the search within the scan's range (that of three quarters of its points): the search ends
    /// where the ascent of an alignment is sure to go on. 56.
    pub resolutions_per_range: f64,
    /// Times the search's coarsest cells are halved. 4.
    pub halvings: u32,
    /// How far points may move by rotation within a cell, as a share of its side. 0.5.
    pub arc_share: f64,
    /// How far the direction of gravity may be wrong, degrees. 2.
    pub gravity_tolerance_deg: f64,
    /// How far a surface's direction may be wrong where the up direction is guessed from surfaces, degrees. 3.
    pub surface_tolerance_deg: f64,
    /// Share of the search points that must fall on the dilated map for a pose to be looked at. 0.6.
    pub search_overlap_min: f64,
    /// Poses of less than this share of the best one's search points are not looked at: as long as there is none
    /// above, no other place can be mistaken for the best. 0.9.
    pub search_share_of_best: f64,
    /// Poses that differ by less than so many voxels of the search are one place. 5.
    pub basin_voxels: f64,
    /// Two poses are the same place where they also differ by less than so many degrees. 10.
    pub basin_deg: f64,
    /// Places of which the search keeps the best. 16.
    pub basins_max: usize,
    /// Fraction of a scan's points that must fall in occupied voxels for a place to be accepted. 0.45: more than an
    /// alignment asks, which knows where to look.
    pub overlap_min: f64,
    /// Share of a scan's rays that may pass through what the map holds for a place to be accepted. 0.4:
    /// rays that graze edges count, in a building with many doors up to a quarter of them.
    pub blocked_max: f64,
    /// Overlap of the runner-up, as a share of the best one's, from which on the two are told apart by nothing.
    /// 0.95.
    pub ambiguous_share: f64,
    /// Bytes that the dilated levels of one search may take. 512 MiB.
    pub grid_bytes_max: usize,
    /// Cells that may wait to be divided; beyond them the least promising are dropped, and the search is not
    /// exhaustive. 4,000,000.
    pub cells_waiting_max: usize,
}

impl Default for LocalizationSettings {
    fn default() -> Self {
        Self {
            search_points: 300,
            resolutions_per_range: 56.0,
            halvings: 4,
            arc_share: 0.5,
            gravity_tolerance_deg: 2.0,
            surface_tolerance_deg: 3.0,
            search_overlap_min: 0.6,
            search_share_of_best: 0.9,
            basin_voxels: 5.0,
            basin_deg: 10.0,
            basins_max: 16,
            overlap_min: 0.45,
            blocked_max: 0.4,
            ambiguous_share: 0.95,
            grid_bytes_max: 512 << 20,
            cells_waiting_max: 4_000_000,
        }
    }
}
