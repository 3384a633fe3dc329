//! `POST /v1/maps/{map}/undo`: take scans or a deletion back.

use axum::response::Json;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::error::HttpError;
use crate::http::forms::body;
use crate::http::forms::{Map, request_id_of};
use crate::http::middleware::Service;
use crate::json::JsonVersion;
use crate::json::described;
use mrol_map::map::{RobotName, SessionName};
use mrol_service::{Reason, ServiceError, Undo, UndoAnswer, UndoTarget};

/// What is taken back: `robot` and `scan_id` (and `session`), `robot` and `since_revision`, or `revision`.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"robot": "example", "scan_id": 1}))]
pub(crate) struct UndoBody {
    /// The robot whose scans are meant.
    #[schema(value_type = Option<described::RobotName>)]
    robot: Option<String>,
    /// The run of the robot's program; the empty one without.
    #[schema(value_type = Option<described::SessionName>)]
    session: Option<String>,
    /// One scan of the robot.
    scan_id: Option<u64>,
    /// All scans of the robot that made a revision after this one.
    since_revision: Option<u64>,
    /// The scan or the deletion that made this revision.
    revision: Option<u64>,
    /// The caller's own id of this change: sent again, it changes nothing.
    #[schema(value_type = Option<described::RequestId>)]
    request_id: Option<String>,
}

/// What an undo made.
#[derive(Serialize, ToSchema)]
pub(crate) struct UndoResponse {
    /// Scans that were undone.
    scans: usize,
    /// Deletions that were undone.
    deletions: usize,
    /// Finest voxels that went.
    removed: usize,
    /// Finest voxels that came back.
    restored: usize,
    /// True of a request that was answered before: this is that answer.
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Takes scans or a deletion back.
///
/// It needs a data folder, and reaches back to `storage.undo_from_revision`. Undo of a revision that may be
/// another robot's takes the scope `write`.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/undo",
    request_body = UndoBody,
    responses((status = 200, description = "Answered", body = UndoResponse))
)]
pub(crate) async fn undo(
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
