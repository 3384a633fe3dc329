//! Undoing scans and deletions (`mapping.proto`).

use super::pb;
use super::values::{InField, count_from, request_id_from, required, text_of};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{ServiceError, Undo, UndoAnswer, UndoTarget};

impl TryFrom<pb::UndoRequest> for (MapName, Undo) {
    type Error = ServiceError;

    fn try_from(request: pb::UndoRequest) -> Result<Self, ServiceError> {
        use pb::undo_request::Target;
        let target = match required(request.target, "target")? {
            Target::Scan(pb::RobotScan { robot, session, scan_id }) => UndoTarget::Scan {
                robot: RobotName::new(&robot).in_field("scan.robot")?,
                session: SessionName::new(&session).in_field("scan.session")?,
                scan_id,
            },
            Target::Revision(revision) => UndoTarget::Revision(revision),
            Target::Since(pb::RobotSince { robot, revision }) => {
                UndoTarget::RobotSince { robot: RobotName::new(&robot).in_field("since.robot")?, revision }
            }
        };
        Ok((MapName::new(&request.map)?, Undo { target, request_id: request_id_from(&request.request_id)? }))
    }
}

impl From<(&MapName, Undo)> for pb::UndoRequest {
    fn from((map, undo): (&MapName, Undo)) -> Self {
        use pb::undo_request::Target;
        let target = match undo.target {
            UndoTarget::Scan { robot, session, scan_id } => Target::Scan(pb::RobotScan {
                robot: robot.to_string(),
                session: session.to_string(),
                scan_id,
            }),
            UndoTarget::Revision(revision) => Target::Revision(revision),
            UndoTarget::RobotSince { robot, revision } => {
                Target::Since(pb::RobotSince { robot: robot.to_string(), revision })
            }
        };
        Self { map: map.to_string(), target: Some(target), request_id: text_of(undo.request_id) }
    }
}

impl From<UndoAnswer> for pb::UndoResponse {
    fn from(answer: UndoAnswer) -> Self {
        let UndoAnswer { scans, deletions, removed, restored, version, replayed } = answer;
        Self {
            scans: scans as u64,
            deletions: deletions as u64,
            removed: removed as u64,
            restored: restored as u64,
            version: Some(version.into()),
            replayed,
        }
    }
}

impl TryFrom<pb::UndoResponse> for UndoAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::UndoResponse) -> Result<Self, ServiceError> {
        Ok(Self {
            scans: count_from(answer.scans),
            deletions: count_from(answer.deletions),
            removed: count_from(answer.removed),
            restored: count_from(answer.restored),
            version: required(answer.version, "version")?.try_into()?,
            replayed: answer.replayed,
        })
    }
}
