//! Scans and what becomes of them (`mapping.proto`).

use std::time::Duration;

use bytes::Bytes;

use super::pb;
use super::values::{InField, count_from, required};
use mrol_map::align::localize::{Gravity, MAP_DOWN};
use mrol_map::align::{Direction, Method, PoseCovariance, Rival, Verdict};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_map::mapping::{Guess, Recovered};
use mrol_map::scan::PointFilter;
use mrol_map::visibility::SensorModel;
use mrol_service::{Foreground, PointTimes, Reason, ScanAnswer, ScanRequest, ServiceError, TimeReference};

impl TryFrom<pb::InsertScanRequest> for (MapName, ScanRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::InsertScanRequest) -> Result<Self, ServiceError> {
        let scan = scan_from(request.scan, request.guess, request.at_guess, request.method)?;
        Ok((
            MapName::new(&request.map)?,
            ScanRequest { force: request.force, recover: request.recover, carve: request.carve, ..scan },
        ))
    }
}

impl TryFrom<pb::AlignScanRequest> for (MapName, ScanRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::AlignScanRequest) -> Result<Self, ServiceError> {
        let scan = scan_from(request.scan, request.guess, request.at_guess, request.method)?;
        let foreground_level = request.foreground_level;
        Ok((MapName::new(&request.map)?, ScanRequest { foreground_level, ..scan }))
    }
}

fn scan_from(
    scan: Option<pb::Scan>,
    guess: Option<pb::Guess>,
    at_guess: bool,
    method: i32,
) -> Result<ScanRequest, ServiceError> {
    let scan = required(scan, "scan")?;
    let filter = filter_from(&scan)?;
    Ok(ScanRequest {
        session: SessionName::new(&scan.session).in_field("scan.session")?,
        scan_id: scan.scan_id,
        timestamp_ns: scan.timestamp_ns,
        point_times: point_times_from(&scan.point_times, scan.point_times_reference)?,
        gravity: scan.gravity_in_sensor.map(gravity_from).transpose()?,
        guess_covariance: covariance_from(guess.as_ref())?,
        guess: guess_from(guess)?,
        at_guess,
        method: method_from(method)?,
        filter,
        sensor: sensor_from(&scan.sensor)?,
        strict: scan.strict,
        ..ScanRequest::new(
            RobotName::new(&scan.robot).in_field("scan.robot")?,
            required(scan.points, "scan.points")?.try_into().in_field("scan.points")?,
        )
    })
}

/// The times of points; none where there are no bytes.
fn point_times_from(bytes: &[u8], reference: i32) -> Result<Option<PointTimes>, ServiceError> {
    let reference = match pb::TimeReference::try_from(reference) {
        Ok(pb::TimeReference::Unspecified | pb::TimeReference::Timestamp) => TimeReference::Timestamp,
        Ok(pb::TimeReference::SweepStart) => TimeReference::SweepStart,
        Err(_) => {
            let message = format!(
                "scan.point_times_reference must be 0, 1 (timestamp) or 2 (sweep start), got {reference}"
            );
            return Err(ServiceError::new(Reason::BadPointTimes, message));
        }
    };
    let times = (!bytes.is_empty()).then(|| PointTimes::from_bytes(bytes, reference));
    times.transpose().in_field("scan.point_times")
}

fn filter_from(scan: &pb::Scan) -> Result<PointFilter, ServiceError> {
    let body = |body: &pb::Box| -> Result<_, ServiceError> {
        let min_m = required(body.min_m, "scan.body.min_m")?.into();
        Ok((min_m, required(body.max_m, "scan.body.max_m")?.into()))
    };
    Ok(PointFilter {
        range_min_m: scan.range_min_m,
        range_max_m: scan.range_max_m,
        body_m: scan.body.as_ref().map(body).transpose()?,
        ..PointFilter::default()
    })
}

/// The model of a sensor; none where there is no text.
fn sensor_from(text: &str) -> Result<Option<SensorModel>, ServiceError> {
    let model = (!text.is_empty()).then(|| text.parse::<SensorModel>());
    model.transpose().in_field("scan.sensor")
}

fn method_from(number: i32) -> Result<Option<Method>, ServiceError> {
    match pb::Method::try_from(number) {
        Ok(pb::Method::Unspecified) => Ok(None),
        Ok(pb::Method::Refined) => Ok(Some(Method::Refined)),
        Ok(pb::Method::Overlap) => Ok(Some(Method::Overlap)),
        Err(_) => {
            let message = format!("method must be 0, 1 (refined) or 2 (overlap), got {number}");
            Err(ServiceError::new(Reason::BadMethod, message))
        }
    }
}

impl From<Option<Method>> for pb::Method {
    fn from(method: Option<Method>) -> Self {
        match method {
            None => Self::Unspecified,
            Some(Method::Refined) => Self::Refined,
            Some(Method::Overlap) => Self::Overlap,
        }
    }
}

fn guess_from(guess: Option<pb::Guess>) -> Result<Guess, ServiceError> {
    let Some(guess) = guess else { return Ok(Guess::Last) };
    if guess.kind.is_none() && !guess.covariance.is_empty() {
        return Ok(Guess::Last);
    }
    match required(guess.kind, "guess.kind")? {
        pb::guess::Kind::MapFromSensor(pose) => {
            Ok(Guess::Pose(pose.try_into().in_field("guess.map_from_sensor")?))
        }
        pb::guess::Kind::LastFromSensor(motion) => {
            Ok(Guess::Motion(motion.try_into().in_field("guess.last_from_sensor")?))
        }
        pb::guess::Kind::ConstantVelocity(true) => Ok(Guess::ConstantVelocity),
        pb::guess::Kind::ConstantVelocity(false) => {
            let message = "guess.constant_velocity must be true: leave the guess out for the last pose";
            Err(ServiceError::new(Reason::BadGuess, message))
        }
    }
}

/// The guess of a scan; absent where there is nothing to say.
fn guess_of(scan: &ScanRequest) -> Option<pb::Guess> {
    let kind = match &scan.guess {
        Guess::Last => None,
        Guess::Pose(pose) => Some(pb::guess::Kind::MapFromSensor(pose.into())),
        Guess::Motion(motion) => Some(pb::guess::Kind::LastFromSensor(motion.into())),
        Guess::ConstantVelocity => Some(pb::guess::Kind::ConstantVelocity(true)),
    };
    let covariance: Vec<f64> = scan.guess_covariance.iter().flat_map(PoseCovariance::rows).collect();
    (kind.is_some() || !covariance.is_empty()).then_some(pb::Guess { kind, covariance })
}

/// The direction of gravity in the frame of a sensor, in a map whose z axis points up.
pub fn gravity_in_sensor(in_sensor: [f64; 3]) -> Result<Gravity, ServiceError> {
    Gravity::new(in_sensor, MAP_DOWN).map_err(|_| {
        let message = format!(
            "gravity_in_sensor must be a finite direction other than zero, in which things fall, got {in_sensor:?}"
        );
        ServiceError::new(Reason::BadGravity, message)
    })
}

fn gravity_from(in_sensor: pb::Vector3) -> Result<Gravity, ServiceError> {
    gravity_in_sensor(in_sensor.into()).in_field("scan")
}

/// The covariance of a guess; none where there are no numbers.
fn covariance_from(guess: Option<&pb::Guess>) -> Result<Option<PoseCovariance>, ServiceError> {
    let rows = guess.map(|guess| &guess.covariance[..]).filter(|rows| !rows.is_empty());
    rows.map(PoseCovariance::new).transpose().in_field("guess")
}

impl From<ScanRequest> for pb::Scan {
    fn from(scan: ScanRequest) -> Self {
        let body = |(min_m, max_m): ([f64; 3], [f64; 3])| pb::Box {
            min_m: Some(min_m.into()),
            max_m: Some(max_m.into()),
        };
        Self {
            robot: scan.robot.to_string(),
            session: scan.session.to_string(),
            scan_id: scan.scan_id,
            point_times_reference: match scan.point_times.as_ref().map(PointTimes::reference) {
                None => pb::TimeReference::Unspecified.into(),
                Some(TimeReference::Timestamp) => pb::TimeReference::Timestamp.into(),
                Some(TimeReference::SweepStart) => pb::TimeReference::SweepStart.into(),
            },
            point_times: scan.point_times.map(|times| times.to_bytes().into()).unwrap_or_default(),
            points: Some(scan.points.into()),
            timestamp_ns: scan.timestamp_ns,
            gravity_in_sensor: scan.gravity.map(|gravity| gravity.in_sensor().into()),
            strict: scan.strict,
            range_min_m: scan.filter.range_min_m,
            range_max_m: scan.filter.range_max_m,
            body: scan.filter.body_m.map(body),
            sensor: scan.sensor.map(|model| model.to_string()).unwrap_or_default(),
        }
    }
}

impl From<(&MapName, ScanRequest)> for pb::InsertScanRequest {
    fn from((map, scan): (&MapName, ScanRequest)) -> Self {
        let (guess, at_guess) = (guess_of(&scan), scan.at_guess);
        let (force, recover, carve) = (scan.force, scan.recover, scan.carve);
        let method = pb::Method::from(scan.method).into();
        Self { map: map.to_string(), scan: Some(scan.into()), guess, at_guess, method, force, recover, carve }
    }
}

impl From<(&MapName, ScanRequest)> for pb::AlignScanRequest {
    fn from((map, scan): (&MapName, ScanRequest)) -> Self {
        let (guess, at_guess, foreground_level) = (guess_of(&scan), scan.at_guess, scan.foreground_level);
        let method = pb::Method::from(scan.method).into();
        Self { map: map.to_string(), scan: Some(scan.into()), guess, at_guess, method, foreground_level }
    }
}

impl From<Verdict> for pb::Verdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Accepted => Self::Accepted,
            Verdict::LowOverlap => Self::LowOverlap,
            Verdict::Undetermined => Self::Undetermined,
            Verdict::Ambiguous => Self::Ambiguous,
            Verdict::Contradicted => Self::Contradicted,
        }
    }
}

pub(super) fn verdict_from(number: i32) -> Result<Verdict, ServiceError> {
    match pb::Verdict::try_from(number) {
        Ok(pb::Verdict::Accepted) => Ok(Verdict::Accepted),
        Ok(pb::Verdict::LowOverlap) => Ok(Verdict::LowOverlap),
        Ok(pb::Verdict::Undetermined) => Ok(Verdict::Undetermined),
        Ok(pb::Verdict::Ambiguous) => Ok(Verdict::Ambiguous),
        Ok(pb::Verdict::Contradicted) => Ok(Verdict::Contradicted),
        Ok(pb::Verdict::Unspecified) | Err(_) => {
            let message = format!("alignment.verdict must lie in 1..=5, got {number}");
            Err(ServiceError::new(Reason::BadVerdict, message))
        }
    }
}

impl From<Option<Recovered>> for pb::Recovered {
    fn from(recovered: Option<Recovered>) -> Self {
        match recovered {
            None => Self::Unspecified,
            Some(Recovered::LastPose) => Self::LastPose,
            Some(Recovered::ConstantVelocity) => Self::ConstantVelocity,
            Some(Recovered::ChainedScans) => Self::ChainedScans,
            Some(Recovered::Localization) => Self::Localization,
        }
    }
}

fn recovered_from(number: i32) -> Result<Option<Recovered>, ServiceError> {
    match pb::Recovered::try_from(number) {
        Ok(pb::Recovered::Unspecified) => Ok(None),
        Ok(pb::Recovered::LastPose) => Ok(Some(Recovered::LastPose)),
        Ok(pb::Recovered::ConstantVelocity) => Ok(Some(Recovered::ConstantVelocity)),
        Ok(pb::Recovered::ChainedScans) => Ok(Some(Recovered::ChainedScans)),
        Ok(pb::Recovered::Localization) => Ok(Some(Recovered::Localization)),
        Err(_) => {
            let message = format!("recovered must lie in 0..=4, got {number}");
            Err(ServiceError::new(Reason::BadVerdict, message))
        }
    }
}

impl From<&ScanAnswer> for pb::Alignment {
    fn from(answer: &ScanAnswer) -> Self {
        Self {
            verdict: pb::Verdict::from(answer.verdict).into(),
            map_from_sensor: Some((&answer.map_from_sensor).into()),
            overlap: answer.overlap(),
            level_overlaps: answer.level_overlaps.clone(),
            iterations: answer.iterations,
            points_skipped: answer.points_skipped as u64,
            reason: answer.reason.clone(),
            inliers: answer.inliers,
            fitness: answer.fitness,
            information: answer.information.iter().flatten().flatten().copied().collect(),
            undetermined: answer.undetermined.iter().map(Into::into).collect(),
            align_ms: answer.align_time.as_secs_f64() * 1e3,
            rays: answer.rays.map(Into::into),
            rivals: answer.rivals.iter().map(Into::into).collect(),
        }
    }
}

impl From<&Direction> for pb::Direction {
    fn from(open: &Direction) -> Self {
        Self { direction: open.direction.to_vec(), std_m: open.std_m }
    }
}

impl TryFrom<pb::Direction> for Direction {
    type Error = ServiceError;

    fn try_from(open: pb::Direction) -> Result<Self, ServiceError> {
        let direction = <[f64; 6]>::try_from(open.direction).map_err(|numbers| {
            let message = format!("alignment.undetermined must be directions of 6, got {}", numbers.len());
            ServiceError::new(Reason::BadDirection, message)
        })?;
        Ok(Self { direction, std_m: open.std_m })
    }
}

/// The rows of a 6 x 6 matrix; none where there are no numbers.
fn information_from(numbers: &[f64]) -> Result<Option<[[f64; 6]; 6]>, ServiceError> {
    match numbers.as_chunks::<6>() {
        ([], []) => Ok(None),
        (&[a, b, c, d, e, f], []) => Ok(Some([a, b, c, d, e, f])),
        _ => {
            let message = format!("alignment.information must have 36 numbers, got {}", numbers.len());
            Err(ServiceError::new(Reason::BadInformation, message))
        }
    }
}

impl From<ScanAnswer> for pb::InsertScanResponse {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted,
            alignment: Some((&answer).into()),
            new_voxels: answer.new_voxels as u64,
            version: Some(answer.version.into()),
            replayed: answer.replayed,
            stationary: answer.stationary,
            error: None,
            recovered: pb::Recovered::from(answer.recovered).into(),
            carved_voxels: answer.carved_voxels as u64,
        }
    }
}

impl From<pb::Failure> for pb::InsertScanResponse {
    fn from(failure: pb::Failure) -> Self {
        Self { error: Some(failure), ..Self::default() }
    }
}

impl From<ScanAnswer> for pb::AlignScanResponse {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted,
            alignment: Some((&answer).into()),
            version: Some(answer.version.into()),
            foreground_points: answer.foreground.as_ref().map_or(0, |foreground| foreground.points as u64),
            foreground: answer.foreground.map_or_else(Bytes::new, |foreground| foreground.bitmap),
        }
    }
}

impl TryFrom<pb::InsertScanResponse> for ScanAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::InsertScanResponse) -> Result<Self, ServiceError> {
        let judged = pb::AlignScanResponse {
            accepted: answer.accepted,
            alignment: answer.alignment,
            version: answer.version,
            ..Default::default()
        };
        let recovered = recovered_from(answer.recovered)?;
        let judged = Self::try_from(judged)?;
        let (new_voxels, carved_voxels) = (count_from(answer.new_voxels), count_from(answer.carved_voxels));
        let (replayed, stationary) = (answer.replayed, answer.stationary);
        Ok(Self { new_voxels, carved_voxels, replayed, stationary, recovered, ..judged })
    }
}

impl TryFrom<pb::AlignScanResponse> for ScanAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::AlignScanResponse) -> Result<Self, ServiceError> {
        let alignment = required(answer.alignment, "alignment")?;
        let map_from_sensor = required(alignment.map_from_sensor, "alignment.map_from_sensor")?;
        Ok(Self {
            accepted: answer.accepted,
            verdict: verdict_from(alignment.verdict)?,
            reason: alignment.reason,
            map_from_sensor: map_from_sensor.try_into().in_field("alignment.map_from_sensor")?,
            level_overlaps: alignment.level_overlaps,
            inliers: alignment.inliers,
            fitness: alignment.fitness,
            information: information_from(&alignment.information)?,
            undetermined: alignment
                .undetermined
                .into_iter()
                .map(Direction::try_from)
                .collect::<Result<_, _>>()?,
            rays: alignment.rays.map(Into::into),
            rivals: alignment
                .rivals
                .into_iter()
                .map(Rival::try_from)
                .collect::<Result<_, _>>()
                .in_field("alignment.rivals")?,
            iterations: alignment.iterations,
            align_time: Duration::try_from_secs_f64(alignment.align_ms / 1e3).unwrap_or_default(),
            points_skipped: count_from(alignment.points_skipped),
            new_voxels: 0,
            carved_voxels: 0,
            foreground: (!answer.foreground.is_empty()).then_some(Foreground {
                bitmap: answer.foreground,
                points: count_from(answer.foreground_points),
            }),
            version: required(answer.version, "version")?.try_into()?,
            replayed: false,
            stationary: false,
            recovered: None,
        })
    }
}
