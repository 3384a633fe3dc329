//! Why a scan cannot be mapped.

use crate::map::RobotName;
use crate::scan::PointFilterError;

/// Why a scan cannot be mapped. The map is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// A point is not finite, and the caller asked that all are.
    #[error("strict: points[{index}] is not finite, and {count} points are not")]
    NotFinite {
        /// The first such point.
        index: usize,
        /// How many points there are.
        count: usize,
    },
    /// No point is finite.
    #[error("none of the scan's {points} points is finite: nothing but no-returns")]
    NoReturns {
        /// The scan's points.
        points: usize,
    },
    /// The filter makes no sense.
    #[error(transparent)]
    BadFilter(#[from] PointFilterError),
    /// The filter leaves no point.
    #[error("none of the scan's {points} points passes {filter} of robot {robot}")]
    AllFiltered {
        /// The scan's points.
        points: usize,
        /// The filter, as text.
        filter: String,
        /// Whose scan it is.
        robot: RobotName,
    },
    /// The guess is relative to a pose of the robot, and there is none.
    #[error("guess required: robot {0} has no accepted scan in the map, which is not empty")]
    GuessRequired(RobotName),
    /// No point has a voxel.
    #[error("no point of the scan lies within the map's range of {min_m} to {end_m} m")]
    OutOfRange {
        /// The smallest coordinate of the map, meters.
        min_m: f64,
        /// The end of its coordinates, meters.
        end_m: f64,
    },
    /// The stop signal ended it: its caller has gone, or its time is up.
    #[error("the mapping of the scan was stopped")]
    Stopped,
}
