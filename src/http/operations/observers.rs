//! `GET /v1/maps/{map}/observers?point=x,y,z&level=`, or with `voxel=i,j,k`: the scans that touched a voxel.

use axum::response::Json;
use serde::Deserialize;
use utoipa::IntoParams;

use crate::http::error::HttpError;
use crate::http::forms::{Map, Numbers3, Params, numbers};
use crate::http::middleware::Service;
use crate::json::JsonObservers;
use mrol_map::geometry::Point;
use mrol_map::voxel::VoxelKey;
use mrol_service::{ObservedVoxel, ObserversRequest, Reason, ServiceError};

/// Which voxel: exactly one of `point` and `voxel`.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ObserversParams {
    /// A point `x,y,z` in the voxel, meters.
    #[param(value_type = Option<Numbers3>, inline, example = "1,1,0.5")]
    point: Option<String>,
    /// The voxel `i,j,k`, in the place of `point`.
    #[param(value_type = Option<Numbers3>, inline)]
    voxel: Option<String>,
    /// The level, 0 the finest; 0 without.
    #[serde(default)]
    level: u32,
}

/// Lists the scans that touched a voxel, the newest first.
///
/// It needs a data folder. At most `limits.observers_max` scans are told.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/observers",
    params(ObserversParams),
    responses((status = 200, description = "Answered", body = JsonObservers))
)]
pub(crate) async fn list(
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
