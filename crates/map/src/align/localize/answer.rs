//! Results of global localization.

use crate::align::verdict::{Alignment, Verdict};
use crate::geometry::Pose;
use crate::map::ContentVersion;

/// Result of a global localization: where a scan may have been taken, and whether to believe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Localization {
    /// Verdict on the best candidate: accepted only where it fits and no other place is as good.
    pub verdict: Verdict,
    /// Reason for the verdict, a sentence with the figures.
    pub reason: String,
    /// Distinct places that fit, best first; empty where none does.
    pub candidates: Vec<Candidate>,
    /// True when every pose of the search box was considered: the direction of gravity was given, and the search ended
    /// by itself.
    pub exhaustive: bool,
    /// True when the search was stopped before its end.
    pub cut_short: bool,
    /// Number of cells of poses whose bound was computed.
    pub cells: u64,
    /// The version of the map that was searched.
    pub version: ContentVersion,
}

/// A place that a scan fits.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Alignment of the scan at this place, after refinement.
    pub alignment: Alignment,
    /// Fraction of the search's points that fall on the dilated map at this place.
    pub search_overlap: f64,
    /// Fraction of the scan's rays that pass through occupied voxels of the map before they reach their points.
    pub blocked: f64,
    /// Difference of the candidate's [`fit`](Self::fit) and that of the best other candidate; none where there is no
    /// other.
    pub margin: Option<f64>,
}

impl Candidate {
    /// The candidate's pose, map_from_sensor.
    pub fn map_from_sensor(&self) -> Pose {
        self.alignment.map_from_sensor
    }

    /// Score that candidates are ranked by: the overlap with the map times the share of the rays that are not blocked.
    /// Overlap alone prefers clutter.
    pub fn fit(&self) -> f64 {
        self.alignment.overlap() * (1.0 - self.blocked)
    }
}

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchProgress {
    /// Number of cells of poses whose bound was computed.
    pub cells: u64,
    /// Number of cells that wait to be divided.
    pub waiting: usize,
    /// The best [`Candidate::search_overlap`] so far.
    pub best_overlap: f64,
}

/// Why a scan cannot be localized.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LocalizationError {
    /// Every point is too far away to be on any map.
    #[error("no point of the scan is within {extent_m} m, farther than two places of the map can lie apart")]
    NothingInRange {
        /// Largest distance between two places of a map, meters.
        extent_m: f64,
    },
    /// The map has no voxel.
    #[error("the map is empty: nothing to localize in")]
    EmptyMap,
    /// The map has no voxel within the scan's range of the search box.
    #[error("search_box is nowhere near the map: no voxel is within {range_m:.1} m of it, the scan's range")]
    NothingThere {
        /// Largest range of the scan, meters.
        range_m: f64,
    },
    /// The search takes more memory than its caller allows.
    #[error("there is no memory for {bytes} bytes more of the search")]
    NoMemory {
        /// Number of bytes that were requested.
        bytes: usize,
    },
    /// The grids of the search would take more memory than
    /// [`LocalizationSettings::grid_bytes_max`](super::LocalizationSettings::grid_bytes_max).
    #[error(
        "the part of the map to search takes {bytes} bytes at the coarsest resolution of use, {resolution_m} m, \
         localization_grid_bytes_max is {bytes_max}: give a smaller search_box"
    )]
    TooLarge {
        /// Number of bytes that the grids take.
        bytes: usize,
        /// Resolution of the coarsest grids that the search can use, meters.
        resolution_m: f64,
        /// Limit on the bytes.
        bytes_max: usize,
    },
}

impl Localization {
    /// The answer of a search that was stopped before its data structures were built.
    pub(super) fn cut_short_at_once(version: ContentVersion) -> Self {
        Self {
            verdict: Verdict::Ambiguous,
            reason: "the search was cut short before it began".into(),
            candidates: Vec::new(),
            exhaustive: false,
            cut_short: true,
            cells: 0,
            version,
        }
    }
}
