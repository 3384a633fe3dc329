//! Settings of global localization.

/// Settings of [`super::localize`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalizationSettings {
    /// Number of sample points that a cell of poses is bounded with. 300.
    pub search_points: usize,
    /// Number of finest search voxels within the scan's range (that of three quarters of its points): the search ends
    /// at cells from which the ascent of an alignment converges. 56.
    pub resolutions_per_range: f64,
    /// Number of times that the coarsest cells are halved. 4.
    pub halvings: u32,
    /// Distance that points may move by rotation within a cell, as a share of the cell's side. 0.5.
    pub arc_share: f64,
    /// Largest error of the direction of gravity, degrees. 2.
    pub gravity_tolerance_deg: f64,
    /// Largest error of a surface normal, degrees, where rotations are derived from surfaces. 3.
    pub surface_tolerance_deg: f64,
    /// Least share of the search points that fall on the dilated map for a pose to be considered: half of a scan may
    /// show what nobody saw. 0.4.
    pub search_overlap_min: f64,
    /// Least share of the best pose's search points for a pose to be considered. Another place can be mistaken for the
    /// best only above it. 0.9.
    pub search_share_of_best: f64,
    /// Two poses are the same place where they differ by less than this many search voxels. 5.
    pub basin_voxels: f64,
    /// Two poses are the same place where they also differ by less than so many degrees. 10.
    pub basin_deg: f64,
    /// Number of best places that the search keeps. 16.
    pub basins_max: usize,
    /// Most bytes of the dilated levels of one search. 512 MiB.
    pub grid_bytes_max: usize,
    /// Most cells that may wait to be divided; beyond it the least promising are dropped, and the search is not
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
            search_overlap_min: 0.4,
            search_share_of_best: 0.9,
            basin_voxels: 5.0,
            basin_deg: 10.0,
            basins_max: 16,
            grid_bytes_max: 512 << 20,
            cells_waiting_max: 4_000_000,
        }
    }
}
