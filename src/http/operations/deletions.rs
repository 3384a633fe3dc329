//! `POST /v1/maps/{map}/deletions`: take voxels out.

use axum::response::Json;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::Object;
use crate::http::forms::PointBytes;
use crate::http::forms::{BoxBody, OrientedBoxBody, SphereBody};
use crate::http::forms::{Map, request_id_of};
use crate::http::forms::{Points, points_of, two_forms};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{JsonVersion, VoxelIndex};
use mrol_map::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey};
use mrol_service::{Deletion, DeletionAnswer, DeletionTarget, Reason, ServiceError};

two_forms! {
    /// What is deleted: exactly one target.
    #[schema(example = json!({"sphere": {"center_m": [50, 50, 50], "radius_m": 0.1}}))]
    body DeletionBody {
        /// The voxels of these points.
        #[schema(value_type = Option<JsonPoints>)]
        points: Option<JsonPoints>,
        /// Voxels of the level by their indices.
        #[schema(value_type = Option<Vec<VoxelIndex>>)]
        voxels: Option<Vec<[i32; 3]>>,
        /// The voxels whose centers lie in a box along the map's axes.
        #[schema(value_type = Option<BoxBody>)]
        r#box: Option<Object<BoxBody>>,
        /// The voxels whose centers lie in a ball.
        #[schema(value_type = Option<SphereBody>)]
        sphere: Option<Object<SphereBody>>,
        /// The voxels whose centers lie in a box with any orientation.
        #[schema(value_type = Option<OrientedBoxBody>)]
        oriented_box: Option<Object<OrientedBoxBody>>,
        /// Of a region, only what no scan after this revision touched although one saw well beyond.
        not_seen_since: Option<u64>,
    }

    /// With points as bytes: what else there is to a deletion.
    params DeletionParams {}

    both {
        /// The level whose voxels are meant, 0 the finest; 0 without.
        #[serde(default)]
        level: u32,
        /// The caller's own id of this change: sent again, it changes nothing.
        request_id: Option<String> as Option<described::RequestId>,
    }
}

type DeletionPoints = Points<DeletionBody, DeletionParams>;

/// What a deletion made.
#[derive(Serialize, ToSchema)]
pub(crate) struct DeletionResponse {
    /// Finest voxels that went.
    removed: usize,
    /// True of a request that was answered before: this is that answer.
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Deletes voxels.
///
/// Voxels that are not there are no error. Scans that were inserted stay known.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/deletions",
    params(DeletionParams),
    request_body(content((DeletionBody = "application/json"), (PointBytes = "application/octet-stream"))),
    responses((status = 200, description = "Answered", body = DeletionResponse))
)]
pub(crate) async fn delete(
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
