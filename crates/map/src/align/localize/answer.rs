//! Results of global localization.

use crate::align::agreement::{RayAgreement, Rival};
use crate::align::verdict::Verdict;
use crate::geometry::Pose;
use crate::map::ContentVersion;

/// Result of a global localization: where a scan may have been taken, and whether to believe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Localization {
    /// Verdict on the first candidate: accepted only where rays believe it and no other place is as likely.
    pub verdict: Verdict,
    /// Reason for the verdict, a sentence with the figures.
    pub reason: String,
    /// Distinct places that fit, best first; empty where none does. First comes the one that the verdict is on, then
    /// those where the scan and earlier scans saw enough of each other, by [the smaller share of rays that
    /// agree](RayAgreement::worse), then the others, by overlap.
    pub candidates: Vec<Candidate>,
    /// Poses that the scan may have been taken at as well as at the first candidate: why it is
    /// [ambiguous](Verdict::Ambiguous).
    pub rivals: Vec<Rival>,
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Where the sensor was, after refinement: map_from_sensor.
    pub map_from_sensor: Pose,
    /// Fraction of the points in occupied voxels of level 0.
    pub overlap: f64,
    /// Fraction of a volumetric sample of the points that lie on the map's surfaces.
    pub inliers: f64,
    /// How rays agree there; none where the search was stopped before they were asked.
    pub agreement: Option<RayAgreement>,
}

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchProgress {
    /// Number of cells of poses whose bound was computed.
    pub cells: u64,
    /// Number of cells that wait to be divided.
    pub waiting: usize,
    /// The largest fraction so far of the search's points that fall on the dilated map.
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
            rivals: Vec::new(),
            exhaustive: false,
            cut_short: true,
            cells: 0,
            version,
        }
    }
}
