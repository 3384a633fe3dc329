//! Scans to insert or align, and their answers.

use std::time::Duration;

use bytes::Bytes;

use super::point_cloud::PointCloud;
use super::point_times::PointTimes;
use super::version::MapVersion;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use mrol_map::align::localize::Gravity;
use mrol_map::align::{Direction, Method, PoseCovariance, RayAgreement, Rival, Verdict};
use mrol_map::geometry::Pose;
use mrol_map::map::{RobotName, SessionName};
use mrol_map::mapping::{Guess, Recovered};
use mrol_map::scan::PointFilter;
use mrol_map::visibility::SensorModel;

/// A scan to align or insert.
#[derive(Debug, Clone)]
pub struct ScanRequest {
    /// The robot that sends the scan.
    pub robot: RobotName,
    /// The run of the robot's software that sends it: scan ids are unique within it.
    pub session: SessionName,
    /// The robot's own number of the scan; makes insertion idempotent.
    pub scan_id: Option<u64>,
    /// In the sensor frame; not finite = no return.
    pub points: PointCloud,
    /// When the scan was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// When each point was measured, seconds from `timestamp_ns`, where the sensor moved meanwhile.
    pub point_times: Option<PointTimes>,
    /// Direction of gravity, as an accelerometer tells.
    pub gravity: Option<Gravity>,
    /// Where it is thought to have been taken.
    pub guess: Guess,
    /// How far off the guess may be.
    pub guess_covariance: Option<PoseCovariance>,
    /// Take the guess as it is, without aligning.
    pub at_guess: bool,
    /// Add the scan where it was found even if the verdict is not `accepted`.
    pub force: bool,
    /// Look for the robot where the scan is refused; where none, as the server is set for this robot.
    pub recover: Option<bool>,
    /// Take out of the map what the scan saw through; where none, as the server is set for this robot.
    pub carve: Option<bool>,
    /// How to align; the server's own where none.
    pub method: Option<Method>,
    /// Say too which points fall in no occupied voxel of this level; of an alignment only.
    pub foreground_level: Option<u32>,
    /// Which points count, before what the server is set to for this robot.
    pub filter: PointFilter,
    /// How the rays of its sensor lie; where none, as the server is set for this robot.
    pub sensor: Option<SensorModel>,
    /// Refuse the scan instead of skipping points that are not finite.
    pub strict: bool,
}

impl ScanRequest {
    /// # Errors
    /// For what an insertion does not take.
    pub(crate) fn check_insertion(&self) -> Result<(), ServiceError> {
        let message = "foreground_level is for an alignment, which changes nothing: an insertion does not tell the \
                       foreground; ask for the alignment first, or leave it out";
        self.foreground_level.map_or(Ok(()), |_| Err(ServiceError::new(Reason::UnexpectedField, message)))
    }

    /// # Errors
    /// For what an alignment does not take.
    pub(crate) fn check_alignment(&self) -> Result<(), ServiceError> {
        let message = "force is for an insertion: an alignment changes nothing, leave it out";
        if self.force {
            return Err(ServiceError::new(Reason::UnexpectedField, message));
        }
        let message = "recover is for an insertion: an alignment remembers nothing, leave it out";
        self.recover.map_or(Ok(()), |_| Err(ServiceError::new(Reason::UnexpectedField, message)))?;
        let message = "carve is for an insertion: an alignment takes nothing out of the map, leave it out";
        self.carve.map_or(Ok(()), |_| Err(ServiceError::new(Reason::UnexpectedField, message)))
    }

    /// # Errors
    /// For too many points or none, times that are not as many, and times without a timestamp.
    pub(crate) fn check_points(&self, limits: &Limits) -> Result<(), ServiceError> {
        limits.check_points(self.points.len())?;
        let times = self.point_times.as_ref();
        times.map_or(Ok(()), |times| times.check(self.points.len(), self.timestamp_ns))
    }

    /// A robot's scan, of which nothing else is said.
    pub fn new(robot: RobotName, points: PointCloud) -> Self {
        Self {
            robot,
            session: SessionName::default(),
            scan_id: None,
            points,
            timestamp_ns: None,
            point_times: None,
            gravity: None,
            guess: Guess::Last,
            guess_covariance: None,
            at_guess: false,
            force: false,
            recover: None,
            carve: None,
            method: None,
            foreground_level: None,
            filter: PointFilter::default(),
            sensor: None,
            strict: false,
        }
    }
}

/// What became of a scan, or would have.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanAnswer {
    /// True when the map took it, or would.
    pub accepted: bool,
    /// What its alignment is worth.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub reason: String,
    /// Where it was taken.
    pub map_from_sensor: Pose,
    /// Fraction of its points in occupied voxels, level by level, finest first; before it was added.
    pub level_overlaps: Vec<f64>,
    /// Fraction of a sample of its points that lie on the map's surfaces.
    pub inliers: f64,
    /// How closely they do, 0 to 1.
    pub fitness: f64,
    /// Rows of the information matrix, see [`mrol_map::align::PoseInformation`]; none of an answer that is given again.
    pub information: Option<[[f64; 6]; 6]>,
    /// Directions of the pose that the map's surfaces leave open.
    pub undetermined: Vec<Direction>,
    /// How rays agree there; none where the caller told the pose, and of an answer that is given again.
    pub rays: Option<RayAgreement>,
    /// Poses that it may have been taken at as well: why it is ambiguous.
    pub rivals: Vec<Rival>,
    /// Steps of the alignment.
    pub iterations: u32,
    /// Time that it took.
    pub align_time: Duration,
    /// Points that were not finite, at 0 0 0, out of the robot's range, on its body, or out of the map's range.
    pub points_skipped: usize,
    /// Finest voxels added; 0 where nothing was.
    pub new_voxels: usize,
    /// Finest voxels carved: those that the scan saw through.
    pub carved_voxels: usize,
    /// After it, or where it was refused, before.
    pub version: MapVersion,
    /// The points that the map does not show, where they were asked for.
    pub foreground: Option<Foreground>,
    /// True of a scan that was accepted before: this is that answer.
    pub replayed: bool,
    /// The robot stands where its last scan was taken and sees nothing new: it was accepted and not kept.
    pub stationary: bool,
    /// How the robot, which was lost, was found again; none of a scan that fits from its own guess, or nowhere.
    pub recovered: Option<Recovered>,
}

/// What is in front of the background that a map is: the points of a scan in no occupied voxel (paper \[9\]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foreground {
    /// Point i is bit i % 8 (lowest first) of byte i / 8; points that do not count are not of it.
    pub bitmap: Bytes,
    /// Number of its points.
    pub points: usize,
}

impl ScanAnswer {
    /// Fraction of the points in occupied voxels of level 0.
    pub fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }
}
