//! `POST /v1/maps/{map}/deletions`: take voxels out.

use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body::{Points, points_of};
use super::error::HttpError;
use super::json::JsonPoints;
use super::middleware::Service;
use super::object::Object;
use super::params::{Map, request_id_of};
use super::shapes::{BoxBody, OrientedBoxBody, SphereBody};
use crate::service::{Deletion, DeletionAnswer, DeletionTarget, Reason, ServiceError};
use crate::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey};
use crate::wire::json::JsonVersion;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeletionBody {
    points: Option<JsonPoints>,
    voxels: Option<Vec<[i32; 3]>>,
    r#box: Option<Object<BoxBody>>,
    sphere: Option<Object<SphereBody>>,
    oriented_box: Option<Object<OrientedBoxBody>>,
    #[serde(default)]
    level: u32,
    request_id: Option<String>,
    not_seen_since: Option<u64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeletionParams {
    #[serde(default)]
    level: u32,
    request_id: Option<String>,
}

type DeletionPoints = Points<DeletionBody, DeletionParams>;

#[derive(Serialize)]
pub(super) struct DeletionResponse {
    removed: usize,
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

pub(super) async fn delete(
    Service(service): Service,
    Map(map): Map,
    deletion: DeletionPoints,
) -> Result<Json<DeletionResponse>, HttpError> {
    let answer = service.delete_voxels(&map, deletion.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<DeletionPoints> for Deletion {
    type Error = ServiceError;

    fn try_from(body: DeletionPoints) -> Result<Self, ServiceError> {
        match body {
            Points::Json(mut json) => {
                let request_id = request_id_of(json.request_id.take())?;
                let (level, since) = (json.level, json.not_seen_since);
                let target = DeletionTarget::try_from(json)?.not_seen_since(since)?;
                Ok(Self { level, request_id, target })
            }
            Points::Bytes(body, DeletionParams { level, request_id }) => {
                let points = points_of(body)?;
                let request_id = request_id_of(request_id)?;
                Ok(Self { level, request_id, target: DeletionTarget::Points(points) })
            }
        }
    }
}

impl TryFrom<DeletionBody> for DeletionTarget {
    type Error = ServiceError;

    fn try_from(json: DeletionBody) -> Result<Self, ServiceError> {
        match (json.points, json.voxels, json.r#box, json.sphere, json.oriented_box) {
            (Some(points), None, None, None, None) => Ok(Self::Points(points.into())),
            (None, Some(voxels), None, None, None) => Ok(Self::Keys(keys_of(&voxels)?)),
            (None, None, Some(Object(body)), None, None) => Ok(Self::Region(body.try_into()?)),
            (None, None, None, Some(Object(body)), None) => Ok(Self::Region(body.try_into()?)),
            (None, None, None, None, Some(Object(body))) => Ok(Self::Region(body.try_into()?)),
            _ => {
                let message = "exactly one of points, voxels, box, sphere and oriented_box must be given";
                Err(ServiceError::new(Reason::AmbiguousTarget, message))
            }
        }
    }
}

fn keys_of(voxels: &[[i32; 3]]) -> Result<Vec<VoxelKey>, ServiceError> {
    let key = |(i, &voxel): (usize, &[i32; 3])| {
        VoxelKey::new(voxel).ok_or_else(|| {
            let message =
                format!("voxels[{i}] must lie in {INDEX_MIN}..={INDEX_MAX} in each axis, got {voxel:?}");
            ServiceError::new(Reason::BadKey, message)
        })
    };
    voxels.iter().enumerate().map(key).collect()
}

impl From<DeletionAnswer> for DeletionResponse {
    fn from(answer: DeletionAnswer) -> Self {
        Self { removed: answer.removed, replayed: answer.replayed, version: answer.version.into() }
    }
}
