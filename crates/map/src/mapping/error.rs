//! Errors of mapping.

use crate::map::RobotName;
use crate::scan::{PointFilterError, SkippedPoints};

/// Why a scan cannot be mapped. The map is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// A point is not finite, and the caller asked that all are.
    #[error("strict: points[{index}] is not finite, and {count} points are not")]
    NotFinite {
        /// Index of the first point that is not finite.
        index: usize,
        /// Number of points that are not finite.
        count: usize,
    },
    /// No point is one at which a ray ended.
    #[error(
        "none of the scan's {points} points is a return: {zeros} are at 0 0 0, the others are not finite; \
         keep_zeros of the robot's settings keeps those at 0 0 0"
    )]
    NoReturns {
        /// Number of points of the scan.
        points: usize,
        /// Number of points at 0 0 0.
        zeros: usize,
    },
    /// The point filter is not valid.
    #[error(transparent)]
    BadFilter(#[from] PointFilterError),
    /// The filter leaves no point.
    #[error("none of the scan's {points} points passes the filter of robot {robot}: {filter} ({skipped})")]
    AllFiltered {
        /// Number of points of the scan.
        points: usize,
        /// The filter, as text.
        filter: String,
        /// Why they were skipped.
        skipped: SkippedPoints,
        /// The robot whose scan it is.
        robot: RobotName,
    },
    /// The guess is relative to the robot's last accepted pose, and the robot has none in this map.
    #[error("guess required: robot {0} has no accepted scan in the map, which is not empty")]
    GuessRequired(RobotName),
    /// No point of the scan lies within the range of the map's coordinates.
    #[error("no point of the scan lies within the map's range of {min_m} to {end_m} m")]
    OutOfRange {
        /// The smallest coordinate of the map, meters.
        min_m: f64,
        /// The end of the map's coordinates (exclusive), meters.
        end_m: f64,
    },
    /// Mapping was stopped: the caller cancelled it, or its time is up.
    #[error("the mapping of the scan was stopped")]
    Stopped,
}
