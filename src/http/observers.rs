//! `GET /v1/maps/{map}/observers?point=x,y,z&level=`, or with `voxel=i,j,k`: the scans that touched a voxel.

use axum::response::Json;
use serde::Deserialize;

use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, Params, numbers};
use crate::geometry::Point;
use crate::service::{ObservedVoxel, ObserversRequest, Reason, ServiceError};
use crate::voxel::VoxelKey;
use crate::wire::json::JsonObservers;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObserversParams {
    point: Option<String>,
    voxel: Option<String>,
    #[serde(default)]
    level: u32,
}

pub(super) async fn list(
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<ObserversParams>,
) -> Result<Json<JsonObservers>, HttpError> {
    let answer = service.list_observers(&map, params.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<ObserversParams> for ObserversRequest {
    type Error = ServiceError;

    fn try_from(ObserversParams { point, voxel, level }: ObserversParams) -> Result<Self, ServiceError> {
        let voxel = match (point, voxel) {
            (Some(point), None) => {
                let point: [f64; 3] = numbers(&point, "point")?;
                ObservedVoxel::Of(Point::from(nalgebra::Point3::from(point)))
            }
            (None, Some(voxel)) => ObservedVoxel::Key(key_of(&voxel)?),
            (Some(_), Some(_)) => {
                let message = "exactly one of point and voxel must be given";
                return Err(ServiceError::new(Reason::AmbiguousTarget, message));
            }
            (None, None) => return Err(ServiceError::new(Reason::MissingField, "point or voxel is missing")),
        };
        Ok(Self { voxel, level })
    }
}

/// The key of the voxel `i,j,k`.
fn key_of(text: &str) -> Result<VoxelKey, ServiceError> {
    let index: [f64; 3] = numbers(text, "voxel")?;
    let is_whole = index.iter().all(|i| i.fract() == 0.0);
    VoxelKey::new(index.map(|i| i as i32)).filter(|_| is_whole).ok_or_else(|| {
        ServiceError::new(Reason::BadKey, format!("voxel must be whole indices in range, got {index:?}"))
    })
}
