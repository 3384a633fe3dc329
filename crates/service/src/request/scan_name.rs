//! The name of a scan in errors.

use crate::error::{Reason, ServiceError};
use mrol_map::map::{RobotName, SessionName};

/// The error of a scan that was accepted so long ago that nothing is stored of it but its id, or may have been.
pub(crate) fn scan_id_too_old(robot: &RobotName, session: &SessionName, scan_id: u64) -> ServiceError {
    let message = format!(
        "{} is too old: a scan of that id was accepted, or may have been, before what undo reaches, and its answer is \
         not stored; number new scans upwards, in a session with a new name after a restart",
        scan_name(robot, session, scan_id)
    );
    ServiceError::new(Reason::ScanIdTooOld, message)
}

/// A scan, in errors.
pub(crate) fn scan_name(robot: &RobotName, session: &SessionName, scan_id: u64) -> String {
    match session.is_empty() {
        true => format!("scan_id {scan_id} of robot {robot}"),
        false => format!("scan_id {scan_id} of session {session} of robot {robot}"),
    }
}
