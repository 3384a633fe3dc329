//! `GET /v1/maps/{map}/trajectory?robot=&since_revision=&limit=`: the poses of the accepted scans, of all robots or of
//! one. With a `limit`, a page of them, which says where the next one begins; without, all.

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use tokio::sync::mpsc::Sender;
use tokio_stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;
use utoipa::{IntoParams, ToSchema};

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::{Map, Params};
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::json::described;
use crate::json::{JsonPose, JsonVersion};
use mrol_map::map::{MappedScan, RobotName};
use mrol_service::{MapService, Reason, ServiceError, TrajectoryAnswer, TrajectoryPieces, TrajectoryQuery};

/// Which poses.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TrajectoryParams {
    /// The robot; all of them without.
    #[param(value_type = Option<described::RobotName>, inline)]
    robot: Option<String>,
    /// Scans that made a revision after this one; 0 without.
    #[param(required = false)]
    #[serde(default)]
    since_revision: u64,
    /// Poses of one page, at most `limits.trajectory_page_max`; all poses without.
    #[param(minimum = 1, example = 3)]
    limit: Option<usize>,
}

/// What stands behind the poses.
#[derive(Serialize, ToSchema)]
struct TrajectoryEnd {
    #[serde(flatten)]
    version: JsonVersion,
    /// Where the next page begins; absent of the last one.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    next_since_revision: Option<u64>,
}

/// A page, which is there as a whole.
#[derive(Serialize, ToSchema)]
struct TrajectoryPage {
    /// The poses, by revision.
    poses: Vec<PoseResponse>,
    #[serde(flatten)]
    end: TrajectoryEnd,
}

/// An accepted scan.
#[derive(Serialize, ToSchema)]
struct PoseResponse {
    /// The robot that sent the scan.
    robot: String,
    /// The run of the robot's software.
    session: String,
    /// The robot's own number of the scan.
    scan_id: Option<u64>,
    /// When it was taken, nanoseconds since the Unix epoch.
    timestamp_ns: Option<i64>,
    /// Where it was taken.
    map_from_sensor: JsonPose,
    /// The revision that it made.
    revision: u64,
    /// Fraction of its points in voxels that were occupied before.
    overlap: f64,
    /// Finest voxels that it added.
    new_voxels: usize,
    /// Finest voxels that it carved.
    carved_voxels: usize,
}

/// Lists the poses of the accepted scans: all, or a page.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/trajectory",
    params(TrajectoryParams),
    responses((status = 200, description = "Answered", body = TrajectoryPage))
)]
pub(crate) async fn get(
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
        let end = TrajectoryEnd { version: version.into(), next_since_revision };
        let bytes = poses.len() * BYTES_PER_POSE;
        let page = move || TrajectoryPage { poses: poses.iter().map(PoseResponse::from).collect(), end };
        return pieces::whole(&service, bytes, page).await;
    }
    let mut found = service.trajectory_pieces(&map, query).await?;
    let kept = adapter.admission.keep(found.memory_bytes())?;
    // What fails at once is answered as such.
    let first = found.next().await.transpose()?;
    let (outbox, text) = mpsc::channel(1);
    tokio::spawn(write(service, first, found, outbox));
    let text = ReceiverStream::new(text).map(move |piece| {
        let _until_sent = &kept;
        piece.map(Bytes::from)
    });
    Ok(([(header::CONTENT_TYPE, "application/json")], Body::from_stream(text)).into_response())
}

/// Sends `{"poses":[...],<state>}` in pieces. What fails on
/// the way breaks the answer off.
async fn write(
    service: MapService,
    first: Option<TrajectoryAnswer>,
    mut pieces: TrajectoryPieces,
    outbox: Sender<Result<String, ServiceError>>,
) {
    let mut text = "{\"poses\":[".to_owned();
    let (mut piece, mut is_first, mut next_since_revision) = (first.map(Ok), true, None);
    while let Some(found) = piece {
        let written = match found {
            Ok(found) => {
                next_since_revision = found.next_since_revision;
                let (mut text, comma) = (std::mem::take(&mut text), !is_first);
                is_first &= found.poses.is_empty();
                let append = move || append_poses(&mut text, &found.poses, comma).map(|()| text);
                service.convert(append).await.flatten()
            }
            Err(error) => Err(error),
        };
        let failed = written.is_err();
        if outbox.send(written).await.is_err() || failed {
            return;
        }
        piece = pieces.next().await;
    }
    let end = json(&TrajectoryEnd { version: pieces.version().into(), next_since_revision });
    let end = end.map(|end| format!("],{}", end.trim_start_matches('{')));
    drop(outbox.send(end).await);
}

/// Appends poses, the first of them behind a comma where it follows others.
fn append_poses(text: &mut String, poses: &[MappedScan], mut comma: bool) -> Result<(), ServiceError> {
    for pose in poses {
        if std::mem::replace(&mut comma, true) {
            text.push(',');
        }
        text.push_str(&json(&PoseResponse::from(pose))?);
    }
    Ok(())
}

/// About as many bytes as a pose takes as JSON.
const BYTES_PER_POSE: usize = 512;

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
