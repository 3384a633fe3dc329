//! `POST /v1/maps/{map}/deletions`: take voxels out.

use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body::Points;
use super::error::HttpError;
use super::json::{JsonPoints, JsonState};
use super::middleware::Service;
use super::object::Object;
use super::parameters::{Map, request_id_of};
use crate::map::Region;
use crate::service::{Deletion, DeletionAnswer, DeletionTarget, ServiceError};
use crate::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeletionJson {
    points: Option<JsonPoints>,
    voxels: Option<Vec<[i32; 3]>>,
    r#box: Option<Object<BoxJson>>,
    sphere: Option<Object<SphereJson>>,
    #[serde(default)]
    level: u32,
    request_id: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxJson {
    min_m: [f64; 3],
    max_m: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SphereJson {
    center_m: [f64; 3],
    radius_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeletionQuery {
    #[serde(default)]
    level: u32,
    request_id: Option<String>,
}

type DeletionBody = Points<DeletionJson, DeletionQuery>;

#[derive(Serialize)]
pub(super) struct DeletionOut {
    removed: usize,
    replayed: bool,
    #[serde(flatten)]
    state: JsonState,
}

pub(super) async fn delete(
    Service(service): Service,
    Map(map): Map,
    deletion: DeletionBody,
) -> Result<Json<DeletionOut>, HttpError> {
    let answer = service.delete_voxels(&map, deletion.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<DeletionBody> for Deletion {
    type Error = ServiceError;

    fn try_from(body: DeletionBody) -> Result<Self, ServiceError> {
        match body {
            Points::Json(mut json) => {
                let request_id = request_id_of(json.request_id.take())?;
                Ok(Self { level: json.level, request_id, target: json.try_into()? })
            }
            Points::Bytes(points, DeletionQuery { level, request_id }) => {
                let request_id = request_id_of(request_id)?;
                Ok(Self { level, request_id, target: DeletionTarget::Points(points) })
            }
        }
    }
}

impl TryFrom<DeletionJson> for DeletionTarget {
    type Error = ServiceError;

    fn try_from(json: DeletionJson) -> Result<Self, ServiceError> {
        match (json.points, json.voxels, json.r#box, json.sphere) {
            (Some(points), None, None, None) => Ok(Self::Points(points.into())),
            (None, Some(voxels), None, None) => Ok(Self::Keys(keys_of(&voxels)?)),
            (None, None, Some(Object(BoxJson { min_m, max_m })), None) => {
                Ok(Self::Region(Region::cuboid(min_m, max_m)?))
            }
            (None, None, None, Some(Object(SphereJson { center_m, radius_m }))) => {
                Ok(Self::Region(Region::ball(center_m, radius_m)?))
            }
            _ => {
                let message = "exactly one of points, voxels, box and sphere must be given";
                Err(ServiceError::invalid("ambiguous_target", message))
            }
        }
    }
}

fn keys_of(voxels: &[[i32; 3]]) -> Result<Vec<VoxelKey>, ServiceError> {
    let key = |(i, &voxel): (usize, &[i32; 3])| {
        VoxelKey::new(voxel).ok_or_else(|| {
            let message =
                format!("voxels[{i}] must lie in {INDEX_MIN}..={INDEX_MAX} in each axis, got {voxel:?}");
            ServiceError::invalid("bad_key", message)
        })
    };
    voxels.iter().enumerate().map(key).collect()
}

impl From<DeletionAnswer> for DeletionOut {
    fn from(answer: DeletionAnswer) -> Self {
        Self { removed: answer.removed, replayed: answer.replayed, state: answer.state.into() }
    }
}
