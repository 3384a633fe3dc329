//! `POST /v1/maps/{map}/scans` and `/alignment`: insert a scan, or only align it.

use axum::body::Bytes;
use axum::response::Json;

use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::List;
use crate::http::forms::Object;
use crate::http::forms::ScanBytes;
use crate::http::forms::{Map, Numbers3, Numbers6, Numbers7, Numbers36, params};
use crate::http::forms::{Points, points_of, two_forms};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{ByKeyword, Corners3, JsonPose, JsonScan, Vector3};
use mrol_client::wire::{InField, gravity_in_sensor};
use mrol_map::align::{Method, PoseCovariance};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_map::scan::PointFilter;
use mrol_map::visibility::SensorModel;
use mrol_service::{PointTimes, Reason, ScanRequest, ServiceError, TimeReference};

/// Numbers of a covariance of a pose.
const COVARIANCE_NUMBERS: usize = 36;

two_forms! {
    /// A scan, and where it is thought to have been taken.
    #[schema(example = json!({
        "robot": "example", "scan_id": 1, "points": [[1, 1, 0.5], [1, 1.05, 0.5]], "align": false,
        "guess": {"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]}
    }))]
    body ScanBody {
        /// The points, in the sensor frame.
        points: JsonPoints,
        /// Seconds from `timestamp_ns`, one for each point, of a sensor that moves during its sweep.
        point_times: Option<Vec<f32>>,
        /// Where the scan is thought to have been taken, `map_from_sensor`; the robot's last accepted pose
        /// without.
        #[schema(value_type = Option<JsonPose>)]
        guess: Option<Object<JsonPose>>,
        /// In the place of a guess: how far it is from the last accepted pose, `last_from_sensor`.
        #[schema(value_type = Option<JsonPose>)]
        motion: Option<Object<JsonPose>>,
        /// How far off the guess may be: 6 x 6 numbers, row by row, x y z in meters and then turns about the
        /// map's axes in radians.
        #[schema(value_type = Option<Vec<f64>>, min_items = 36, max_items = 36)]
        guess_covariance: Option<List<f64, COVARIANCE_NUMBERS>>,
        /// The direction in which things fall, in the sensor frame; any length.
        #[schema(value_type = Option<Vector3>)]
        gravity_in_sensor: Option<[f64; 3]>,
        /// Points in this box are of the robot itself, and skipped: its smallest and its largest coordinates,
        /// meters, in the sensor frame.
        #[schema(value_type = Option<Corners3>)]
        body_m: Option<[[f64; 3]; 2]>,
    }

    /// With points as bytes: what else there is to a scan.
    params ScanParams {
        /// Whether times come behind the points; false without.
        #[serde(default)]
        point_times: bool,
        /// Where the scan is thought to have been taken, `x,y,z,qx,qy,qz,qw`; the robot's last accepted pose
        /// without.
        #[param(value_type = Option<Numbers7>, inline)]
        guess: Option<String>,
        /// In the place of a guess: how far it is from the last accepted pose, `x,y,z,qx,qy,qz,qw`.
        #[param(value_type = Option<Numbers7>, inline)]
        motion: Option<String>,
        /// How far off the guess may be: 36 numbers, row by row.
        #[param(value_type = Option<Numbers36>, inline)]
        guess_covariance: Option<String>,
        /// The direction in which things fall, `x,y,z` in the sensor frame; any length.
        #[param(value_type = Option<Numbers3>, inline)]
        gravity_in_sensor: Option<String>,
        /// Points in this box are of the robot itself, and skipped: `x,y,z,x,y,z`, meters, in the sensor frame.
        #[param(value_type = Option<Numbers6>, inline)]
        body_m: Option<String>,
    }

    both {
        /// The robot that sends it.
        robot: String as described::RobotName,
        /// The run of the robot's program; empty without.
        #[serde(default)]
        session: String as described::SessionName where required = false,
        /// The robot's own number of the scan, ascending and unique in its session: sent again, it changes
        /// nothing.
        scan_id: Option<u64>,
        /// When it was taken, nanoseconds since the Unix epoch.
        timestamp_ns: Option<i64>,
        /// Whether the times count from the beginning of the sweep, and `timestamp_ns` is its end; false without.
        #[serde(default)]
        point_times_from_sweep_start: bool,
        /// In the place of a guess: as far from the last accepted pose as that is from the one before; false
        /// without.
        #[serde(default)]
        constant_velocity: bool,
        /// Whether the scan is aligned; true without. False adds it at its guess.
        #[serde(default = "yes")]
        align: bool where required = false,
        /// Whether it is added whatever its verdict; false without.
        #[serde(default)]
        force: bool,
        /// Whether the robot is looked for where the scan is refused; the robot's setting without. For `/scans`
        /// alone.
        recover: Option<bool>,
        /// Whether what the scan saw through is taken out of the map; the robot's setting without. For `/scans`
        /// alone.
        carve: Option<bool>,
        /// How it is aligned; the server's setting without.
        method: Option<ByKeyword<Method>> as Option<described::Method>,
        /// Tell the points that fall in no occupied voxel of this level. For `/alignment` alone.
        foreground_level: Option<u32>,
        /// Nearer points are skipped, meters; the robot's setting without.
        range_min_m: Option<f64>,
        /// Farther points are skipped, meters; the robot's setting without.
        range_max_m: Option<f64>,
        /// How the rays of its sensor lie: `spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG` or `pinhole WIDTH HEIGHT FX
        /// FY`; the robot's setting without.
        sensor: Option<String>,
        /// Whether points that are not finite are an error; false without: they are skipped.
        #[serde(default)]
        strict: bool,
    }
}

type ScanPoints = Points<ScanBody, ScanParams>;

/// Aligns a scan and, where its verdict is good, adds it to the map.
///
/// The first scan of an empty map goes in at its guess. A refused scan is an answer and not an error.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/scans",
    params(ScanParams),
    request_body(content((ScanBody = "application/json"), (ScanBytes = "application/octet-stream"))),
    responses((status = 200, description = "Answered", body = JsonScan))
)]
pub(crate) async fn insert(
    Service(service): Service,
    Map(map): Map,
    scan: ScanPoints,
) -> Result<Json<JsonScan>, HttpError> {
    let answer = service.insert_scan(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

/// Says what became of a scan if it were inserted, and changes nothing.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/alignment",
    params(ScanParams),
    request_body(content((ScanBody = "application/json"), (ScanBytes = "application/octet-stream"))),
    responses((status = 200, description = "Answered", body = JsonScan))
)]
pub(crate) async fn align(
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
            sensor: sensor_of(scan.sensor)?,
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
            sensor: sensor_of(self.sensor)?,
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

/// The model of a sensor, where there is a text.
fn sensor_of(text: Option<String>) -> Result<Option<SensorModel>, ServiceError> {
    text.map(|text| text.parse::<SensorModel>()).transpose().in_field("sensor")
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
    PoseCovariance::new(rows).in_field("guess_covariance")
}

fn yes() -> bool {
    true
}
