//! What became of the scans that robots sent, for the people who look after them.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use super::scan::ScanAnswer;
use crate::error::ServiceError;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{RobotName, SessionName};

/// What became of a scan that was sent for insertion.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanEvent {
    /// Greater than that of every event of the map before it; where the clock was not set back, the time of the answer
    /// in microseconds since the Unix epoch, so that numbers go on after a restart.
    pub number: u64,
    /// When the scan was answered, nanoseconds since the Unix epoch.
    pub time_ns: i64,
    /// The robot that sent it.
    pub robot: RobotName,
    /// The run of the robot's software.
    pub session: SessionName,
    /// The robot's own number of it.
    pub scan_id: Option<u64>,
    /// Its points, whether they counted or not.
    pub points: usize,
    /// From the whole request to its answer.
    pub duration: Duration,
    /// The pose that its guess stood for (map_from_sensor); none of a request that failed, and of an answer that is
    /// given again.
    pub guess: Option<Pose>,
    /// Of a robot's last scan, where it was refused: some of its points (sensor frame), so that people see what does
    /// not fit.
    pub sample: Vec<Point>,
    /// What was answered.
    pub answer: Result<Box<ScanAnswer>, FailedScan>,
}

/// Why the request for a scan failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FailedScan {
    /// The stable word for programs: that of a [`Reason`](crate::Reason), which this program may not know yet, or
    /// `caller_gone`.
    pub reason: Cow<'static, str>,
    /// A sentence for people.
    pub message: String,
}

impl From<&ServiceError> for FailedScan {
    fn from(error: &ServiceError) -> Self {
        Self { reason: error.reason.as_str().into(), message: error.message.clone() }
    }
}

/// Which events of a map.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EventsQuery {
    /// Those after this number; all where it is 0, or greater than that of the last event.
    pub since_number: u64,
    /// Those of this robot alone.
    pub robot: Option<RobotName>,
}

/// A message of a watch of events.
#[derive(Debug, Clone, PartialEq)]
pub enum EventMessage {
    /// What became of a scan.
    Event(Arc<ScanEvent>),
    /// There was none in a while.
    Heartbeat,
}
