//! `GET /v1/maps/{map}/trajectory?robot=&since_revision=&limit=`: the poses of the accepted scans, of all robots or of
//! one. With a `limit`, a page of them, which says where the next one begins; without, all.

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc::{self, Sender};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;

use super::Adapter;
use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, Params};
use crate::map::{MappedScan, RobotName};
use crate::service::{Reason, ServiceError, TrajectoryAnswer, TrajectoryPieces, TrajectoryQuery};
use crate::wire::json::{JsonPose, JsonVersion};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrajectoryParams {
    robot: Option<String>,
    #[serde(default)]
    since_revision: u64,
    limit: Option<usize>,
}

/// What stands behind the poses.
#[derive(Serialize)]
struct End {
    #[serde(flatten)]
    version: JsonVersion,
    #[serde(skip_serializing_if = "Option::is_none")]
    next_since_revision: Option<u64>,
}

/// A page, which is there as a whole.
#[derive(Serialize)]
struct Page {
    poses: Vec<PoseResponse>,
    #[serde(flatten)]
    end: End,
}

#[derive(Serialize)]
struct PoseResponse {
    robot: String,
    session: String,
    scan_id: Option<u64>,
    timestamp_ns: Option<i64>,
    map_from_sensor: JsonPose,
    revision: u64,
    overlap: f64,
    new_voxels: usize,
    carved_voxels: usize,
}

pub(super) async fn get(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(query): Params<TrajectoryParams>,
) -> Result<Response, HttpError> {
    let TrajectoryParams { robot, since_revision, limit } = query;
    let robot = robot.map(|name| RobotName::new(&name)).transpose().map_err(ServiceError::from)?;
    let query = TrajectoryQuery { robot, since_revision, limit };
    if query.limit.is_some() {
        let TrajectoryAnswer { poses, next_since_revision, version } =
            service.trajectory(&map, query).await?;
        let end = End { version: version.into(), next_since_revision };
        let poses = poses.iter().map(PoseResponse::from).collect();
        return Ok(Json(Page { poses, end }).into_response());
    }
    let mut pieces = service.trajectory_pieces(&map, query).await?;
    let kept = adapter.admission.keep(pieces.memory_bytes())?;
    // What fails at once is answered as such.
    let first = pieces.next().await.transpose()?;
    let (outbox, text) = mpsc::channel(1);
    tokio::spawn(write(first, pieces, outbox));
    let text = ReceiverStream::new(text).map(move |piece| {
        let _until_sent = &kept;
        piece.map(Bytes::from)
    });
    Ok(([(header::CONTENT_TYPE, "application/json")], Body::from_stream(text)).into_response())
}

/// Sends `{"poses":[...],<state>}` in pieces. What fails on
/// the way breaks the answer off.
async fn write(
    first: Option<TrajectoryAnswer>,
    mut pieces: TrajectoryPieces,
    outbox: Sender<Result<String, ServiceError>>,
) {
    let mut text = "{\"poses\":[".to_owned();
    let (mut piece, mut comma, mut next_since_revision) = (first.map(Ok), "", None);
    while let Some(found) = piece {
        let written = found.and_then(|found| {
            next_since_revision = found.next_since_revision;
            for pose in &found.poses {
                text.push_str(std::mem::replace(&mut comma, ","));
                text.push_str(&json(&PoseResponse::from(pose))?);
            }
            Ok(std::mem::take(&mut text))
        });
        let failed = written.is_err();
        if outbox.send(written).await.is_err() || failed {
            return;
        }
        piece = pieces.next().await;
    }
    let end = json(&End { version: pieces.version().into(), next_since_revision });
    let end = end.map(|end| format!("],{}", end.trim_start_matches('{')));
    drop(outbox.send(end).await);
}

fn json(value: &impl Serialize) -> Result<String, ServiceError> {
    let not_written = |e: serde_json::Error| ServiceError::new(Reason::NotWritten, e.to_string());
    serde_json::to_string(value).map_err(not_written)
}

impl From<&MappedScan> for PoseResponse {
    fn from(pose: &MappedScan) -> Self {
        Self {
            robot: pose.robot.to_string(),
            session: pose.session.to_string(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: (&pose.map_from_sensor).into(),
            revision: pose.revision,
            overlap: pose.overlap(),
            new_voxels: pose.new_voxels,
            carved_voxels: pose.carved_voxels,
        }
    }
}
