//! `GET /v1/maps/{map}/voxels?level=&min=x,y,z&max=x,y,z&keep_out=&count_only=`: the occupied voxels of a level, those in a
//! box or those that a camera sees (`map_from_camera=x,y,z,qx,qy,qz,qw&fov=h,v&range=near,far`), or their number.

use std::fmt::Write;

use axum::extract::State;
use axum::response::{IntoResponse, Json, Response};
use serde::{Deserialize, Serialize};

use super::Adapter;
use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, Params, RegionParams, numbers, pose};
use super::pieces::{self, Pieces};
use crate::map::{Frustum, VoxelSelection};
use crate::service::{ListingRequest, Reason, ServiceError};
use crate::voxel::VoxelKey;
use crate::wire::json::JsonVersion;

/// Voxels that are written to JSON at once, about half a MiB, and the bytes of one at most: three numbers of eight characters,
/// and what stands between them.
const VOXELS: Pieces = Pieces { field: "voxels", items: 32_768, item_bytes: 29 };

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VoxelsParams {
    #[serde(default)]
    level: u32,
    min: Option<String>,
    max: Option<String>,
    map_from_box: Option<String>,
    size: Option<String>,
    #[serde(default)]
    keep_out: bool,
    map_from_camera: Option<String>,
    fov: Option<String>,
    range: Option<String>,
    #[serde(default)]
    count_only: bool,
}

/// What stands before the voxels.
#[derive(Serialize)]
struct Head {
    level: u32,
    resolution_m: f64,
    voxels_total: usize,
    #[serde(flatten)]
    version: JsonVersion,
}

pub(super) async fn list(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<VoxelsParams>,
) -> Result<Response, HttpError> {
    let request = ListingRequest::try_from(params)?;
    let listing = service.list_voxels(&map, request).await?;
    let (resolution_m, voxels_total, version) =
        (listing.resolution_m, listing.voxels_total, listing.version.into());
    let head = Head { level: request.level, resolution_m, voxels_total, version };
    if request.count_only {
        return Ok(Json(head).into_response());
    }
    let (keys, count) = (listing.keys, voxels_total);
    let kept = adapter.admission.keep(count * size_of::<VoxelKey>() + VOXELS.bytes(count))?;
    let write = move |text: &mut String, item: usize| write_voxel(text, keys[item]);
    Ok(pieces::response(VOXELS.of(&head, count, write)?, kept))
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
    use crate::voxel::{INDEX_MAX, INDEX_MIN};

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
