//! A scan request with the points that count.

use crate::error::{Reason, ServiceError};
use crate::request::{PointTimes, ScanRequest};
use crate::settings::ServiceSettings;
use mrol_map::align::PoseCovarianceError;
use mrol_map::geometry::{Point, rotation_xyzw, translation_m};
use mrol_map::mapping::{FilteredPoints, Guess, MappingError, RayEnds, Scan};

/// A scan request with the points of the robot's surroundings.
pub(super) struct FilteredScan<'a> {
    pub(super) request: &'a ScanRequest,
    filtered: FilteredPoints,
    /// The digest of the request.
    pub(super) digest: u64,
}

impl<'a> FilteredScan<'a> {
    /// Leaves out what the request's filter, or the server's for this robot, does not keep.
    ///
    /// # Errors
    /// When no point is left, or one had to be left out of a strict request.
    pub(super) fn of(request: &'a ScanRequest, settings: &ServiceSettings) -> Result<Self, ServiceError> {
        let filter = request.filter.or(settings.of_robot(&request.robot).filter);
        let filtered = FilteredPoints::of(
            RayEnds {
                points: request.points.as_slice(),
                times_s: request.point_times.as_ref().map(PointTimes::as_slice),
            },
            filter,
            &request.robot,
            request.strict,
        )?;
        Ok(Self { request, filtered, digest: digest(request) })
    }

    /// The scan as the core maps it.
    pub(super) fn to_map(&self) -> Scan<'_> {
        let ScanRequest { robot, session, scan_id, timestamp_ns, at_guess, force, .. } = self.request;
        Scan {
            robot,
            session: session.clone(),
            scan_id: *scan_id,
            timestamp_ns: *timestamp_ns,
            points: self.filtered.surroundings().points,
            times_s: self.filtered.surroundings().times_s,
            no_returns: self.filtered.no_returns(),
            of_robot: self.filtered.of_robot(),
            points_skipped: self.filtered.skipped,
            gravity: self.request.gravity,
            guess: self.request.guess,
            guess_covariance: self.request.guess_covariance,
            at_guess: *at_guess,
            force: *force,
            digest: self.digest,
        }
    }

    /// Number of points that were left out.
    pub(super) fn skipped(&self) -> usize {
        self.filtered.skipped
    }

    /// True of a point of the robot's surroundings.
    pub(super) fn keeps(&self, point: Point) -> bool {
        self.filtered.keeps(point)
    }
}

impl From<PoseCovarianceError> for ServiceError {
    fn from(error: PoseCovarianceError) -> Self {
        Self::new(Reason::BadCovariance, error.to_string())
    }
}

impl From<MappingError> for ServiceError {
    fn from(error: MappingError) -> Self {
        let message = error.to_string();
        match error {
            MappingError::NotFinite { .. } => Self::new(Reason::PointNotFinite, message),
            MappingError::NoReturns { .. } => Self::new(Reason::NoReturns, message),
            MappingError::BadFilter(_) => Self::new(Reason::BadFilter, message),
            MappingError::AllFiltered { .. } => Self::new(Reason::AllPointsFiltered, message),
            MappingError::OutOfRange { .. } => Self::new(Reason::ScanOutOfRange, message),
            MappingError::GuessRequired(_) => Self::new(Reason::GuessRequired, message),
            MappingError::Stopped => Self::new(Reason::TimeLimit, message),
        }
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
    let gravity = request.gravity.map(|gravity| gravity.in_sensor());
    let checksum = gravity
        .iter()
        .fold(checksum, |sum, gravity| crc32c::crc32c_append(sum, bytemuck::cast_slice(gravity)));
    let covariance = request.guess_covariance.map(|covariance| covariance.rows());
    let checksum =
        covariance.iter().fold(checksum, |sum, rows| crc32c::crc32c_append(sum, bytemuck::cast_slice(rows)));
    let times = request.point_times.as_ref().map_or(&[][..], PointTimes::as_slice);
    let checksum = crc32c::crc32c_append(checksum, bytemuck::cast_slice(times));
    (request.points.len() as u64) << 32 | u64::from(checksum)
}
