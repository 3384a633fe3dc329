//! Scans and what becomes of them, as structs of mrol.h.

use std::ffi::c_char;
use std::time::Duration;

use mrol_client::align::Verdict;
use mrol_client::align::localize::{Gravity, LocalizationQuery};
use mrol_client::geometry::{Pose, pose, rotation_xyzw};
use mrol_client::map::{RobotName, SessionName};
use mrol_client::mapping::Guess;
use mrol_client::service::{
    LocalizationAnswer, LocalizationRequest, PointCloud, PointTimes, ScanAnswer, ScanRequest, ServiceError,
    TimeReference,
};

use crate::abi::{MESSAGE_BYTES, MapVersion, REASON_BYTES, terminated};
use crate::failure::Failure;
use crate::memory::{self, Question};

/// `mrol_scan`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Scan {
    pub(crate) struct_size: usize,
    pub(crate) robot: *const c_char,
    pub(crate) session: *const c_char,
    pub(crate) scan_id: u64,
    pub(crate) xyz: *const f32,
    pub(crate) count: usize,
    pub(crate) guess: *const f64,
    pub(crate) motion: *const f64,
    pub(crate) gravity: *const f64,
    pub(crate) timestamp_ns: i64,
    pub(crate) point_times_s: *const f32,
    pub(crate) has_scan_id: u8,
    pub(crate) has_timestamp: u8,
    pub(crate) at_guess: u8,
    pub(crate) force: u8,
    pub(crate) reserved: [u8; 4],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for Scan {
    const NAME: &'static str = "scan";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_scan_answer`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ScanOutcome {
    pub(crate) version: MapVersion,
    pub(crate) map_from_sensor: [f64; 7],
    pub(crate) overlap: f64,
    pub(crate) information: [f64; 36],
    pub(crate) new_voxels: u64,
    pub(crate) carved_voxels: u64,
    pub(crate) points_skipped: u64,
    pub(crate) is_accepted: u8,
    pub(crate) is_replayed: u8,
    pub(crate) is_stationary: u8,
    pub(crate) has_information: u8,
    pub(crate) reserved: [u8; 4],
    pub(crate) verdict: [u8; REASON_BYTES],
    pub(crate) reason: [u8; MESSAGE_BYTES],
}

/// `mrol_localization`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Localization {
    pub(crate) struct_size: usize,
    pub(crate) xyz: *const f32,
    pub(crate) count: usize,
    pub(crate) gravity: *const f64,
    pub(crate) time_limit_ms: u64,
    pub(crate) seed: u64,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for Localization {
    const NAME: &'static str = "localization";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_localization_answer`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Localized {
    pub(crate) map_from_sensor: [f64; 7],
    pub(crate) overlap: f64,
    pub(crate) agreement: f64,
    pub(crate) candidates: u64,
    pub(crate) is_accepted: u8,
    pub(crate) is_cut_short: u8,
    pub(crate) reserved: [u8; 6],
    pub(crate) verdict: [u8; REASON_BYTES],
    pub(crate) reason: [u8; MESSAGE_BYTES],
}

impl Scan {
    /// The scan in domain types, with copies of its points: what is sent may outlive a call that runs out of time.
    ///
    /// # Safety
    /// Texts and numbers are there, and nobody writes them during the call.
    pub(crate) unsafe fn parse(&self) -> Result<ScanRequest, Failure> {
        if self.reserved != [0; 4] {
            return Err(Failure::argument("scan.reserved must be zero"));
        }
        // SAFETY: as the caller promises.
        let (robot, session, guess, motion, gravity) = unsafe {
            (
                memory::text(self.robot, "scan.robot")?,
                memory::text(self.session, "scan.session")?,
                pose_of(self.guess, "scan.guess")?,
                pose_of(self.motion, "scan.motion")?,
                gravity_of(self.gravity, "scan.gravity")?,
            )
        };
        let robot = robot.ok_or_else(|| Failure::argument("scan.robot is NULL"))?;
        let session = session.map(|session| SessionName::new(&session)).transpose();
        // SAFETY: as the caller promises.
        let points = unsafe { copied(self.xyz, self.count, "scan.xyz") }?;
        let point_times = if self.point_times_s.is_null() {
            None
        } else {
            // SAFETY: as the caller promises.
            let times = unsafe { memory::span(self.point_times_s, self.count, "scan.point_times_s") }?;
            Some(PointTimes::new(times, TimeReference::Timestamp))
        };
        let guess = match (guess, motion) {
            (Some(_), Some(_)) => {
                return Err(Failure::argument("scan has a guess and a motion: give one of them"));
            }
            (Some(map_from_sensor), None) => Guess::Pose(map_from_sensor),
            (None, Some(last_from_sensor)) => Guess::Motion(last_from_sensor),
            (None, None) => Guess::Last,
        };
        Ok(ScanRequest {
            session: session.map_err(ServiceError::from)?.unwrap_or_default(),
            scan_id: memory::flag(self.has_scan_id, "scan.has_scan_id")?.then_some(self.scan_id),
            timestamp_ns: memory::flag(self.has_timestamp, "scan.has_timestamp")?
                .then_some(self.timestamp_ns),
            point_times,
            gravity,
            guess,
            at_guess: memory::flag(self.at_guess, "scan.at_guess")?,
            force: memory::flag(self.force, "scan.force")?,
            ..ScanRequest::new(RobotName::new(&robot).map_err(ServiceError::from)?, points)
        })
    }
}

impl ScanOutcome {
    pub(crate) fn of(answer: &ScanAnswer) -> Self {
        let mut information = [0.0; 36];
        let rows = answer.information.iter().flatten().flatten();
        information.iter_mut().zip(rows).for_each(|(to, number)| *to = *number);
        Self {
            version: answer.version.into(),
            map_from_sensor: seven_of(&answer.map_from_sensor),
            overlap: answer.overlap(),
            information,
            new_voxels: answer.new_voxels as u64,
            carved_voxels: answer.carved_voxels as u64,
            points_skipped: answer.points_skipped as u64,
            is_accepted: answer.accepted.into(),
            is_replayed: answer.replayed.into(),
            is_stationary: answer.stationary.into(),
            has_information: answer.information.is_some().into(),
            reserved: [0; 4],
            verdict: terminated(answer.verdict.as_str()),
            reason: terminated(&answer.reason),
        }
    }
}

impl Localization {
    /// The request in domain types, with copies of its points.
    ///
    /// # Safety
    /// Numbers are there, and nobody writes them during the call.
    pub(crate) unsafe fn parse(&self) -> Result<LocalizationRequest, Failure> {
        // SAFETY: as the caller promises.
        let (points, gravity) = unsafe {
            (
                copied(self.xyz, self.count, "localization.xyz")?,
                gravity_of(self.gravity, "localization.gravity")?,
            )
        };
        let query = LocalizationQuery { gravity, search_box: None, candidates: 0, seed: self.seed };
        let time_limit = (self.time_limit_ms > 0).then(|| Duration::from_millis(self.time_limit_ms));
        Ok(LocalizationRequest { points, query, time_limit })
    }
}

impl Localized {
    pub(crate) fn of(answer: &LocalizationAnswer) -> Self {
        let best = answer.candidates.first();
        Self {
            map_from_sensor: best
                .map_or([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], |best| seven_of(&best.map_from_sensor)),
            overlap: best.map_or(0.0, |best| best.overlap),
            agreement: best.and_then(|best| best.rays).map_or(0.0, |rays| rays.worse()),
            candidates: answer.candidates.len() as u64,
            is_accepted: (answer.verdict == Verdict::Accepted).into(),
            is_cut_short: answer.cut_short.into(),
            reserved: [0; 6],
            verdict: terminated(answer.verdict.as_str()),
            reason: terminated(&answer.reason),
        }
    }
}

/// Points of a program, copied.
///
/// # Safety
/// As [`memory::points_of`], during the call.
pub(crate) unsafe fn copied(xyz: *const f32, count: usize, name: &str) -> Result<PointCloud, Failure> {
    // SAFETY: as the caller promises.
    let lent = unsafe { memory::points_of(xyz, count, name) }?;
    Ok(lent.as_slice().to_vec().into())
}

/// # Safety
/// `numbers` is NULL, or misaligned, or points to seven.
unsafe fn pose_of(numbers: *const f64, name: &str) -> Result<Option<Pose>, Failure> {
    // SAFETY: as the caller promises.
    let numbers = unsafe { memory::numbers::<7>(numbers, name) }?;
    let made = numbers.map(|[x, y, z, qx, qy, qz, qw]| pose([x, y, z], [qx, qy, qz, qw])).transpose();
    made.map_err(|error| Failure::from(ServiceError::from(error)).of(name))
}

/// # Safety
/// `down` is NULL, or misaligned, or points to three.
unsafe fn gravity_of(down: *const f64, name: &str) -> Result<Option<Gravity>, Failure> {
    // SAFETY: as the caller promises.
    let down = unsafe { memory::numbers::<3>(down, name) }?;
    let made = down.map(|down| Gravity::new(down, [0.0, 0.0, -1.0])).transpose();
    made.map_err(|error| Failure::argument(error.to_string()).of(name))
}

fn seven_of(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation.vector.into(), rotation_xyzw(pose));
    [x, y, z, qx, qy, qz, qw]
}
