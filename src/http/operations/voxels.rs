//! `GET /v1/maps/{map}/voxels?level=&min=x,y,z&max=x,y,z&keep_out=&count_only=`: the occupied voxels of a level, those
//! in a box or those that a camera sees (`map_from_camera=x,y,z,qx,qy,qz,qw&fov=h,v&range=near,far`), or their number.

use std::fmt::Write;

use axum::extract::State;
use axum::response::{IntoResponse, Json, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::{Map, Numbers2, Numbers3, Numbers7, Params, RegionParams, numbers, pose};
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::http::pieces::Pieces;
use crate::json::{JsonVersion, VoxelIndex};
use mrol_map::map::{Frustum, VoxelSelection};
use mrol_map::voxel::VoxelKey;
use mrol_service::{ListingRequest, Reason, ServiceError};

/// Voxels that are written to JSON at once, about half a MiB, and the bytes of one at most: three numbers of eight
/// characters, and what stands between them.
const VOXELS: Pieces = Pieces { field: "voxels", items: 32_768, item_bytes: 29 };

/// Which voxels.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct VoxelsParams {
    /// The level, 0 the finest; 0 without.
    #[serde(default)]
    level: u32,
    /// Smallest coordinates `x,y,z` of a box along the map's axes, meters; together with `max`.
    #[param(value_type = Option<Numbers3>, inline)]
    min: Option<String>,
    /// Largest coordinates `x,y,z`.
    #[param(value_type = Option<Numbers3>, inline)]
    max: Option<String>,
    /// Center and orientation `x,y,z,qx,qy,qz,qw` of a box with any orientation; together with `size`, in the
    /// place of `min` and `max`.
    #[param(value_type = Option<Numbers7>, inline)]
    map_from_box: Option<String>,
    /// Its sides `x,y,z`, meters.
    #[param(value_type = Option<Numbers3>, inline)]
    size: Option<String>,
    /// Whether voxels whose centers lie in keep-outs count as occupied; false without.
    #[serde(default)]
    keep_out: bool,
    /// Where a camera is, `x,y,z,qx,qy,qz,qw`, whose frame has z forward, x right and y down; together with
    /// `fov` and `range`.
    #[param(value_type = Option<Numbers7>, inline)]
    map_from_camera: Option<String>,
    /// Its horizontal and vertical angle of view, radians from edge to edge.
    #[param(value_type = Option<Numbers2>, inline)]
    fov: Option<String>,
    /// How near and how far it sees, meters in front of it.
    #[param(value_type = Option<Numbers2>, inline)]
    range: Option<String>,
    /// Whether only the number of voxels is asked for; false without.
    #[param(example = true)]
    #[serde(default)]
    count_only: bool,
}

/// What stands before the voxels.
#[derive(Serialize, ToSchema)]
struct VoxelsHead {
    /// The level.
    level: u32,
    /// Side of a voxel of the level, meters.
    resolution_m: f64,
    /// The number of voxels.
    voxels_total: usize,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Occupied voxels of a level.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is written in pieces; this describes it")]
struct VoxelsResponse {
    #[serde(flatten)]
    head: VoxelsHead,
    /// Their indices; absent where only their number is asked for.
    #[schema(value_type = Option<Vec<VoxelIndex>>, nullable = false)]
    voxels: Option<Vec<[i32; 3]>>,
}

/// Lists the occupied voxels of a level, those of a region, or those that a camera sees.
///
/// Voxel (i, j, k) spans `[i, i + 1) * resolution_m` in x, and so on. A listing has at most
/// `limits.listed_voxels_max`.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/voxels",
    params(VoxelsParams),
    responses((status = 200, description = "Answered", body = VoxelsResponse))
)]
pub(crate) async fn list(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<VoxelsParams>,
) -> Result<Response, HttpError> {
    let request = ListingRequest::try_from(params)?;
    let listing = service.list_voxels(&map, request).await?;
    let (resolution_m, voxels_total, version) =
        (listing.resolution_m, listing.voxels_total, listing.version.into());
    let head = VoxelsHead { level: request.level, resolution_m, voxels_total, version };
    if request.count_only {
        return Ok(Json(head).into_response());
    }
    let (keys, count) = (listing.keys, voxels_total);
    let kept = adapter.admission.keep(count * size_of::<VoxelKey>() + VOXELS.bytes(count))?;
    let write = move |text: &mut String, item: usize| write_voxel(text, keys[item]);
    Ok(pieces::response(&service, VOXELS.of(&head, count, write)?, kept))
}

fn write_voxel(text: &mut String, key: VoxelKey) {
    let [x, y, z] = key.index();
    // Writing to a String cannot fail.
    let _ = write!(text, "[{x},{y},{z}]");
}

impl TryFrom<VoxelsParams> for ListingRequest {
    type Error = ServiceError;

    fn try_from(params: VoxelsParams) -> Result<Self, ServiceError> {
        let VoxelsParams { level, min, max, map_from_box, size, .. } = params;
        let region = RegionParams { min, max, map_from_box, size }.region()?;
        let view = match [params.map_from_camera, params.fov, params.range] {
            [None, None, None] => None,
            [Some(placed), Some(fov), Some(range)] => Some(Frustum::new(
                pose(&placed, "map_from_camera")?,
                numbers(&fov, "fov")?,
                numbers(&range, "range")?,
            )?),
            _ => {
                let message = "a view takes map_from_camera, fov and range, and not some of them alone";
                return Err(ServiceError::new(Reason::MissingField, message));
            }
        };
        let (keep_out, count_only) = (params.keep_out, params.count_only);
        Ok(Self { level, selection: VoxelSelection { region, view }, keep_out, count_only })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::voxel::{INDEX_MAX, INDEX_MIN};

    #[test]
    fn a_voxel_takes_no_more_text_than_is_kept_for_it() {
        for index in [[INDEX_MIN; 3], [INDEX_MAX; 3], [0, -1, 2]] {
            let mut text = String::new();
            write_voxel(&mut text, VoxelKey::new(index).unwrap());
            assert_eq!(serde_json::from_str::<[i32; 3]>(&text).unwrap(), index);
            assert!(text.len() < VOXELS.item_bytes);
        }
    }
}
