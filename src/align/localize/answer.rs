//! What a search for a scan's place says.

use crate::align::{Alignment, Verdict};
use crate::geometry::Pose;

/// Where a scan may have been taken, and whether to believe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Localization {
    /// Accepted only where the best candidate fits and no other place is as good.
    pub verdict: Verdict,
    /// Why, in a sentence with the figures.
    pub reason: String,
    /// Distinct places, best first; none where nothing fits.
    pub candidates: Vec<Candidate>,
    /// True when every pose of the search box was considered: the way down was known, and the search ended by itself.
    pub exhaustive: bool,
    /// True when the search was stopped before its end.
    pub cut_short: bool,
    /// Cells of poses whose bound was taken.
    pub cells: u64,
    /// The revision of the map that was searched.
    pub revision: u64,
}

/// A place that a scan fits.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// How the scan fits there, after refinement.
    pub alignment: Alignment,
    /// Fraction of the search's points that fall on the dilated map there.
    pub search_overlap: f64,
    /// Fraction of the scan's rays that pass through what the map holds.
    pub blocked: f64,
    /// The candidate's fit less that of the best other candidate; none where there is no other.
    pub margin: Option<f64>,
}

impl Candidate {
    /// The pose.
    pub fn map_from_sensor(&self) -> Pose {
        self.alignment.map_from_sensor
    }

    /// Overlap with the map times the share of the rays that get there: what candidates are ranked by. Overlap alone
    /// prefers clutter.
    pub fn fit(&self) -> f64 {
        self.alignment.overlap() * (1.0 - self.blocked)
    }
}

/// How far a search has got.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchProgress {
    /// Cells of poses whose bound was taken.
    pub cells: u64,
    /// Cells that wait to be divided.
    pub waiting: usize,
    /// The best [`Candidate::search_overlap`] so far.
    pub best_overlap: f64,
}

/// Why a scan cannot be searched for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LocalizationError {
    /// Every point is too far away to be on any map.
    #[error("no point of the scan is within {extent_m} m, farther than two places of the map can lie apart")]
    NothingInRange {
        /// How far that is, meters.
        extent_m: f64,
    },
    /// There is no map yet.
    #[error("the map is empty: nothing to localize in")]
    EmptyMap,
    /// No voxel near the box.
    #[error("search_box is nowhere near the map: no voxel is within {range_m:.1} m of it, the scan's range")]
    NothingThere {
        /// The scan's largest range.
        range_m: f64,
    },
    /// The search takes more memory than its caller allows.
    #[error("there is no memory for {bytes} bytes more of the search")]
    NoMemory {
        /// What it asked for.
        bytes: usize,
    },
    /// The grids would not fit.
    #[error(
        "the part of the map to search takes {bytes} bytes at the coarsest resolution of use, {resolution_m} m, \
         localization_grid_bytes_max is {bytes_max}: give a smaller search_box"
    )]
    TooLarge {
        /// What it takes.
        bytes: usize,
        /// At this resolution.
        resolution_m: f64,
        /// The limit.
        bytes_max: usize,
    },
}
