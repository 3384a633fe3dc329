//! A scan request with the points that count.

use crate::error::{Reason, ServiceError};
use crate::request::{PointTimes, ScanRequest};
use crate::settings::ServiceSettings;
use mrol_map::align::PoseCovarianceError;
use mrol_map::geometry::{Point, rotation_xyzw, translation_m};
use mrol_map::mapping::{FilteredPoints, Guess, MappingError, RayEnds, Scan};
use mrol_map::scan::{SkippedPoints, UnitDoubt};
use mrol_map::visibility::{SensorMismatch, SensorModel, SensorModelError, SensorRays};
use mrol_map::voxel::LatticeFromPoints;

/// A scan request with the points of the robot's surroundings.
pub(super) struct FilteredScan<'a> {
    pub(super) request: &'a ScanRequest,
    filtered: FilteredPoints,
    /// When each of the request's points was measured; not a number of those that do not count.
    pub(super) times: Option<PointTimes>,
    /// How the sensor's rays lie, or why its model is not used; none of an unknown sensor.
    sensor: Option<Result<SensorRays, SensorMismatch>>,
    /// The digest of the request.
    pub(super) digest: u64,
}

impl<'a> FilteredScan<'a> {
    /// Leaves out what the request's filter, or the server's for this robot, does not keep.
    ///
    /// # Errors
    /// When no point is left, one had to be left out of a strict request, or a time of a point that counts is none.
    pub(super) fn of(request: &'a ScanRequest, settings: &ServiceSettings) -> Result<Self, ServiceError> {
        let robot = settings.of_robot(&request.robot);
        let filter = request.filter.or(robot.filter);
        let (points, most_s) = (request.points.as_slice(), settings.limits.point_times_max_s);
        let counts = |i: usize| filter.keeps(points[i]);
        let times = request
            .point_times
            .as_ref()
            .map(|times| times.relative_to_timestamp(counts, most_s))
            .transpose()?;
        let ends = RayEnds { points, times_s: times.as_ref().map(PointTimes::as_slice) };
        let filtered = FilteredPoints::of(ends, filter, &request.robot, request.strict)?;
        let digest = digest(request, times.as_ref());
        let model = request.sensor.or(robot.sensor).map(SensorModel::checked).transpose()?;
        let sensor = model.map(|model| SensorRays::confirmed(&model, points));
        Ok(Self { request, filtered, times, sensor, digest })
    }

    /// Why the model of the scan's sensor is not used, where there is one that is not.
    pub(super) fn sensor_mismatch(&self) -> Option<SensorMismatch> {
        self.sensor.and_then(Result::err)
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
            beyond: self.filtered.beyond(),
            of_robot: self.filtered.of_robot(),
            sensor: self.sensor.and_then(Result::ok),
            points_skipped: self.filtered.skipped.total(),
            gravity: self.request.gravity,
            guess: self.request.guess,
            guess_covariance: self.request.guess_covariance,
            at_guess: *at_guess,
            force: *force,
            digest: self.digest,
        }
    }

    /// How many points were left out, and those that lie beyond the map's range where the scan was found.
    pub(super) fn skipped(&self, from_points: &LatticeFromPoints) -> SkippedPoints {
        let surroundings = self.filtered.surroundings().points;
        let beyond_map = surroundings.iter().filter(|&&point| from_points.index(point).is_none()).count();
        SkippedPoints { beyond_map, ..self.filtered.skipped }
    }

    /// The doubt that its points are in meters, where there is reason to.
    pub(super) fn unit_doubt(&self) -> Option<UnitDoubt> {
        UnitDoubt::of(self.request.points.as_slice().iter().map(|point| point.to_f64()))
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

impl From<SensorModelError> for ServiceError {
    fn from(error: SensorModelError) -> Self {
        Self::new(Reason::BadSensor, error.to_string())
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
fn digest(request: &ScanRequest, times: Option<&PointTimes>) -> u64 {
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
    let times = times.map_or(&[][..], PointTimes::as_slice);
    let checksum = crc32c::crc32c_append(checksum, bytemuck::cast_slice(times));
    (request.points.len() as u64) << 32 | u64::from(checksum)
}
