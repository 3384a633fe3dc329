//! The points of a scan that can be somewhere.

use super::{ScanRequest, ServiceError, ServiceSettings};
use crate::align::Guess;
use crate::geometry::{Point, rotation_xyzw, translation_m};
use crate::scan::PointFilter;

/// A scan reduced to the points that can be somewhere.
pub(super) struct UsableScan<'a> {
    pub(super) request: &'a ScanRequest,
    filter: PointFilter,
    pub(super) points: Vec<Point>,
    /// Points that were left out.
    pub(super) skipped: usize,
    /// Of the request.
    pub(super) digest: u64,
}

impl<'a> UsableScan<'a> {
    /// Sorts out "no return".
    ///
    /// # Errors
    /// When no point is left, or one had to be left out of a strict request.
    pub(super) fn of(request: &'a ScanRequest, settings: &ServiceSettings) -> Result<Self, ServiceError> {
        let all = request.points.as_slice();
        let points: Vec<Point> = all.iter().copied().filter(|point| point.is_finite()).collect();
        let not_finite = all.len() - points.len();
        if request.strict && not_finite > 0 {
            let place = all.iter().position(|point| !point.is_finite()).unwrap_or_default();
            let message = format!("strict: points[{place}] is not finite, and {not_finite} points are not");
            return Err(ServiceError::invalid("point_not_finite", message));
        }
        if points.is_empty() {
            let message = format!("none of the scan's {not_finite} points is finite: nothing but no-returns");
            return Err(ServiceError::invalid("no_returns", message));
        }
        let filter = request.filter.or(settings.filter_of(&request.robot));
        let filter =
            filter.checked().map_err(|error| ServiceError::invalid("bad_filter", error.to_string()))?;
        let points: Vec<Point> = points.into_iter().filter(|&point| filter.keeps(point)).collect();
        if points.is_empty() {
            let message = format!(
                "none of the scan's {} points passes {filter:?} of robot {}",
                all.len(),
                request.robot
            );
            return Err(ServiceError::invalid("all_points_filtered", message));
        }
        Ok(Self { request, filter, skipped: all.len() - points.len(), points, digest: digest(request) })
    }

    /// True of a point of the robot's surroundings.
    pub(super) fn counts(&self, point: Point) -> bool {
        point.is_finite() && self.filter.keeps(point)
    }
}

/// Tells one request from another under the same id: points, guess, and whether to align.
fn digest(request: &ScanRequest) -> u64 {
    let guess = match &request.guess {
        Guess::Last | Guess::ConstantVelocity => Vec::new(),
        Guess::Pose(pose) | Guess::Motion(pose) => {
            [&translation_m(pose)[..], &rotation_xyzw(pose)[..]].concat()
        }
    };
    let guess_kind = match &request.guess {
        Guess::Last | Guess::Pose(_) => 0,
        Guess::Motion(_) => 1,
        Guess::ConstantVelocity => 2,
    };
    let kind = [u8::from(request.at_guess), guess_kind];
    let checksum = crc32c::crc32c(bytemuck::cast_slice(request.points.as_slice()));
    let checksum = crc32c::crc32c_append(checksum, bytemuck::cast_slice(&guess));
    let checksum = crc32c::crc32c_append(checksum, &kind);
    (request.points.len() as u64) << 32 | u64::from(checksum)
}
