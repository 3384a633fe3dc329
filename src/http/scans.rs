//! `POST /v1/maps/{map}/scans` and `/alignment`: insert a scan, or only align it.

use axum::body::Bytes;
use axum::response::Json;
use serde::Deserialize;

use super::body::{Points, points_of};
use super::error::HttpError;
use super::json::JsonPoints;
use super::list::List;
use super::middleware::Service;
use super::object::Object;
use super::params::{self, Map};
use crate::align::{Method, PoseCovariance};
use crate::geometry::{Point, Pose};
use crate::map::{RobotName, SessionName};
use crate::mapping::Guess;
use crate::scan::PointFilter;
use crate::service::{PointTimes, Reason, ScanRequest, ServiceError, TimeReference};
use crate::wire::json::ByKeyword;
use crate::wire::json::{JsonPose, JsonScan};
use crate::wire::{InField, gravity_in_sensor};

/// Numbers of a covariance of a pose.
const COVARIANCE_NUMBERS: usize = 36;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanBody {
    robot: String,
    #[serde(default)]
    session: String,
    scan_id: Option<u64>,
    points: JsonPoints,
    timestamp_ns: Option<i64>,
    point_times: Option<Vec<f32>>,
    #[serde(default)]
    point_times_from_sweep_start: bool,
    guess: Option<Object<JsonPose>>,
    motion: Option<Object<JsonPose>>,
    #[serde(default)]
    constant_velocity: bool,
    guess_covariance: Option<List<f64, COVARIANCE_NUMBERS>>,
    gravity_in_sensor: Option<[f64; 3]>,
    #[serde(default = "yes")]
    align: bool,
    #[serde(default)]
    force: bool,
    recover: Option<bool>,
    carve: Option<bool>,
    method: Option<ByKeyword<Method>>,
    foreground_level: Option<u32>,
    range_min_m: Option<f64>,
    range_max_m: Option<f64>,
    body_m: Option<[[f64; 3]; 2]>,
    #[serde(default)]
    strict: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanParams {
    robot: String,
    #[serde(default)]
    session: String,
    scan_id: Option<u64>,
    timestamp_ns: Option<i64>,
    /// Behind the points come their times.
    #[serde(default)]
    point_times: bool,
    #[serde(default)]
    point_times_from_sweep_start: bool,
    guess: Option<String>,
    motion: Option<String>,
    #[serde(default)]
    constant_velocity: bool,
    guess_covariance: Option<String>,
    gravity_in_sensor: Option<String>,
    #[serde(default = "yes")]
    align: bool,
    #[serde(default)]
    force: bool,
    recover: Option<bool>,
    carve: Option<bool>,
    method: Option<ByKeyword<Method>>,
    foreground_level: Option<u32>,
    range_min_m: Option<f64>,
    range_max_m: Option<f64>,
    body_m: Option<String>,
    #[serde(default)]
    strict: bool,
}

type ScanPoints = Points<ScanBody, ScanParams>;

pub(super) async fn insert(
    Service(service): Service,
    Map(map): Map,
    scan: ScanPoints,
) -> Result<Json<JsonScan>, HttpError> {
    let answer = service.insert_scan(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

pub(super) async fn align(
    Service(service): Service,
    Map(map): Map,
    scan: ScanPoints,
) -> Result<Json<JsonScan>, HttpError> {
    let answer = service.align_scan(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<ScanPoints> for ScanRequest {
    type Error = ServiceError;

    fn try_from(body: ScanPoints) -> Result<Self, ServiceError> {
        match body {
            Points::Json(scan) => scan.try_into(),
            Points::Bytes(body, rest) => rest.with(body),
        }
    }
}

impl TryFrom<ScanBody> for ScanRequest {
    type Error = ServiceError;

    fn try_from(scan: ScanBody) -> Result<Self, ServiceError> {
        let guess = scan.guess.map(|Object(pose)| Pose::try_from(pose).in_field("guess")).transpose()?;
        let motion = scan.motion.map(|Object(pose)| Pose::try_from(pose).in_field("motion")).transpose()?;
        Ok(Self {
            session: SessionName::new(&scan.session)?,
            scan_id: scan.scan_id,
            timestamp_ns: scan.timestamp_ns,
            point_times: scan
                .point_times
                .map(|times| PointTimes::new(&times, reference(scan.point_times_from_sweep_start))),
            gravity: scan.gravity_in_sensor.map(gravity_in_sensor).transpose()?,
            guess: guess_of(guess, motion, scan.constant_velocity)?,
            guess_covariance: scan.guess_covariance.map(|List(rows)| covariance_of(&rows)).transpose()?,
            at_guess: !scan.align,
            force: scan.force,
            recover: scan.recover,
            carve: scan.carve,
            method: scan.method.map(|method| method.0),
            foreground_level: scan.foreground_level,
            filter: PointFilter {
                range_min_m: scan.range_min_m,
                range_max_m: scan.range_max_m,
                body_m: scan.body_m.map(|[min_m, max_m]| (min_m, max_m)),
                ..PointFilter::default()
            },
            strict: scan.strict,
            ..Self::new(RobotName::new(&scan.robot)?, scan.points.into())
        })
    }
}

impl ScanParams {
    fn with(self, mut body: Bytes) -> Result<ScanRequest, ServiceError> {
        let times = self.point_times.then(|| times_behind_points(&mut body)).transpose()?;
        let reference = reference(self.point_times_from_sweep_start);
        let times = times.map(|times| PointTimes::from_bytes(&times, reference)).transpose()?;
        let points = points_of(body)?;
        let pose = |text: Option<String>, field| text.map(|text| params::pose(&text, field)).transpose();
        let gravity =
            self.gravity_in_sensor.map(|text| params::numbers(&text, "gravity_in_sensor")).transpose()?;
        let covariance = self
            .guess_covariance
            .map(|text| params::numbers::<COVARIANCE_NUMBERS>(&text, "guess_covariance"))
            .transpose()?;
        Ok(ScanRequest {
            session: SessionName::new(&self.session)?,
            scan_id: self.scan_id,
            timestamp_ns: self.timestamp_ns,
            point_times: times,
            gravity: gravity.map(gravity_in_sensor).transpose()?,
            guess_covariance: covariance.map(|rows| covariance_of(&rows)).transpose()?,
            guess: guess_of(
                pose(self.guess, "guess")?,
                pose(self.motion, "motion")?,
                self.constant_velocity,
            )?,
            at_guess: !self.align,
            force: self.force,
            recover: self.recover,
            carve: self.carve,
            method: self.method.map(|method| method.0),
            foreground_level: self.foreground_level,
            filter: PointFilter {
                range_min_m: self.range_min_m,
                range_max_m: self.range_max_m,
                body_m: self.body_m.map(|text| corners(&text)).transpose()?,
                ..PointFilter::default()
            },
            strict: self.strict,
            ..ScanRequest::new(RobotName::new(&self.robot)?, points)
        })
    }
}

/// Takes the times off a body of points and times.
fn times_behind_points(body: &mut Bytes) -> Result<Bytes, ServiceError> {
    const BYTES: usize = Point::BYTES + size_of::<f32>();
    if !body.len().is_multiple_of(BYTES) {
        let message = format!(
            "body: with point_times=true all points of {} bytes and then all times of 4 bytes are {BYTES} bytes a point, \
             got {} bytes",
            Point::BYTES,
            body.len()
        );
        return Err(ServiceError::new(Reason::BadPointTimes, message));
    }
    Ok(body.split_off(body.len() / BYTES * Point::BYTES))
}

fn reference(from_sweep_start: bool) -> TimeReference {
    if from_sweep_start { TimeReference::SweepStart } else { TimeReference::Timestamp }
}

/// A box as `x,y,z,x,y,z`.
fn corners(text: &str) -> Result<([f64; 3], [f64; 3]), ServiceError> {
    let [x0, y0, z0, x1, y1, z1] = params::numbers(text, "body_m")?;
    Ok(([x0, y0, z0], [x1, y1, z1]))
}

fn guess_of(
    guess: Option<Pose>,
    motion: Option<Pose>,
    constant_velocity: bool,
) -> Result<Guess, ServiceError> {
    match (guess, motion, constant_velocity) {
        (None, None, false) => Ok(Guess::Last),
        (None, None, true) => Ok(Guess::ConstantVelocity),
        (Some(map_from_sensor), None, false) => Ok(Guess::Pose(map_from_sensor)),
        (None, Some(last_from_sensor), false) => Ok(Guess::Motion(last_from_sensor)),
        _ => {
            let message = "one of guess, motion and constant_velocity can be given, got several";
            Err(ServiceError::new(Reason::AmbiguousGuess, message))
        }
    }
}

fn covariance_of(rows: &[f64]) -> Result<PoseCovariance, ServiceError> {
    PoseCovariance::new(rows).in_field("guess")
}

fn yes() -> bool {
    true
}
