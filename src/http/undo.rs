//! `POST /v1/maps/{map}/undo`: take scans or a deletion back.

use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body;
use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, request_id_of};
use crate::map::{RobotName, SessionName};
use crate::service::{Reason, ServiceError, Undo, UndoAnswer, UndoTarget};
use crate::wire::json::JsonVersion;

/// `{"robot", "scan_id"}`, to which `"session"` may be added, `{"robot", "since_revision"}` or `{"revision"}`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UndoBody {
    robot: Option<String>,
    session: Option<String>,
    scan_id: Option<u64>,
    since_revision: Option<u64>,
    revision: Option<u64>,
    request_id: Option<String>,
}

#[derive(Serialize)]
pub(super) struct UndoResponse {
    scans: usize,
    deletions: usize,
    removed: usize,
    restored: usize,
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

pub(super) async fn undo(
    Service(service): Service,
    Map(map): Map,
    body::Json(undo): body::Json<UndoBody>,
) -> Result<Json<UndoResponse>, HttpError> {
    let answer = service.undo(&map, undo.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<UndoBody> for Undo {
    type Error = ServiceError;

    fn try_from(undo: UndoBody) -> Result<Self, ServiceError> {
        let robot = undo.robot.map(|robot| RobotName::new(&robot)).transpose()?;
        let session = undo.session.map(|session| SessionName::new(&session)).transpose()?;
        let target = match (robot, undo.scan_id, undo.since_revision, undo.revision) {
            (Some(robot), Some(scan_id), None, None) => {
                UndoTarget::Scan { robot, session: session.unwrap_or_default(), scan_id }
            }
            (Some(robot), None, Some(revision), None) if session.is_none() => {
                UndoTarget::RobotSince { robot, revision }
            }
            (None, None, None, Some(revision)) if session.is_none() => UndoTarget::Revision(revision),
            _ => {
                let message =
                    "give robot and scan_id (and the session), robot and since_revision, or revision";
                return Err(ServiceError::new(Reason::AmbiguousTarget, message));
            }
        };
        Ok(Self { target, request_id: request_id_of(undo.request_id)? })
    }
}

impl From<UndoAnswer> for UndoResponse {
    fn from(answer: UndoAnswer) -> Self {
        let UndoAnswer { scans, deletions, removed, restored, version, replayed } = answer;
        Self { scans, deletions, removed, restored, replayed, version: version.into() }
    }
}
