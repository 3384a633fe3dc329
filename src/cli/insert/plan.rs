//! How the scans of the files are sent.

use std::path::PathBuf;

use tokio::sync::mpsc;

use mrol::console::{CliError, Survey};
use mrol_map::align::Method;
use mrol_map::geometry::Pose;
use mrol_map::map::{RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_map::scan::PointFilter;
use mrol_map::visibility::SensorModel;
use mrol_service::ScanRequest;

/// How the scans of the files are sent.
pub(super) struct Plan {
    pub(super) robot: RobotName,
    pub(super) survey: Survey,
    /// Guess of the first scan, and whether to take it as it is.
    pub(super) first: (Guess, bool),
    /// Poses of the scans, map_from_sensor, if they are known.
    pub(super) poses: Option<Vec<Pose>>,
    pub(super) session: SessionName,
    /// Number of the first scan.
    pub(super) first_scan_id: u64,
    /// Guess of the other scans.
    pub(super) next: Guess,
    pub(super) method: Option<Method>,
    pub(super) filter: PointFilter,
    pub(super) sensor: Option<SensorModel>,
    pub(super) force: bool,
    pub(super) recover: Option<bool>,
    pub(super) carve: Option<bool>,
}

impl Plan {
    /// Reads the files one by one from number `from` on and sends them, until the receiver is closed. A scan has the
    /// same number and guess whenever it is sent.
    pub(super) fn send(
        &self,
        files: &[PathBuf],
        from: usize,
        sender: &mpsc::Sender<ScanRequest>,
    ) -> Result<(), CliError> {
        for (k, file) in files.iter().enumerate().skip(from) {
            let (guess, at_guess) = self.guess(k);
            let scan = ScanRequest {
                session: self.session.clone(),
                scan_id: Some(self.first_scan_id.saturating_add(k as u64)),
                guess,
                at_guess,
                force: self.force,
                recover: self.recover,
                carve: self.carve,
                method: self.method,
                filter: self.filter,
                sensor: self.sensor,
                ..ScanRequest::new(self.robot.clone(), self.survey.read(file)?.into())
            };
            if sender.blocking_send(scan).is_err() {
                break;
            }
        }
        Ok(())
    }

    /// The options that make the command do the same once more, without adding a scan twice.
    pub(super) fn repeat_with(&self) -> String {
        let number = format!("--first-scan-id {}", self.first_scan_id);
        match self.session.is_empty() {
            true => number,
            false => format!("--session {} {number}", self.session.as_str()),
        }
    }

    fn guess(&self, k: usize) -> (Guess, bool) {
        match (&self.poses, k) {
            (Some(poses), k) => (Guess::Pose(poses[k]), true),
            (None, 0) => self.first,
            (None, _) => (self.next, false),
        }
    }
}
