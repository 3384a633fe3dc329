//! `GET /v1/maps/{map}/voxels?level=&min=x,y,z&max=x,y,z&keep_out=`: the occupied voxels of a level.

use std::convert::Infallible;
use std::fmt::Write;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};

use super::Adapter;
use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, Params, RegionParams};
use crate::service::{Reason, ServiceError, VoxelQuery};
use crate::voxel::VoxelKey;
use crate::wire::json::JsonVersion;

/// Voxels that are written to JSON at once: about half a MiB.
const VOXELS_PER_CHUNK: usize = 32_768;

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
}

/// Bytes of a voxel in JSON, at most: three numbers of eight characters, and what stands between them.
const VOXEL_BYTES_MAX: usize = 28;

/// Bytes of memory that a listing of so many voxels takes until it is sent: its keys, and two pieces of text, one that is made
/// and one that is sent, either in twice the room where the first guess at it was too small.
fn listing_bytes(voxels: usize) -> usize {
    voxels * size_of::<VoxelKey>() + 4 * voxels.min(VOXELS_PER_CHUNK) * VOXEL_BYTES_MAX
}

/// What stands before the voxels.
#[derive(Serialize)]
struct Head {
    level: u32,
    resolution_m: f64,
    #[serde(flatten)]
    version: JsonVersion,
}

pub(super) async fn list(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(query): Params<VoxelsParams>,
) -> Result<Response, HttpError> {
    let VoxelsParams { level, min, max, map_from_box, size, keep_out } = query;
    let region = RegionParams { min, max, map_from_box, size }.region()?;
    let listing = service.list_voxels(&map, VoxelQuery { level, region, keep_out }).await?;
    let head = Head { level, resolution_m: listing.resolution_m, version: listing.version.into() };
    let kept = adapter.admission.keep(listing_bytes(listing.keys.len()))?;
    let chunks = chunks(head, listing.keys)?.map(move |chunk| {
        let _until_sent = &kept;
        Ok::<_, Infallible>(Bytes::from(chunk))
    });
    let body = Body::from_stream(tokio_stream::iter(chunks));
    Ok(([(header::CONTENT_TYPE, "application/json")], body).into_response())
}

/// `{<head>,"voxels":[[i,j,k],...]}` in pieces, each made when it is asked for: a listing may be larger than any
/// other answer.
fn chunks(head: Head, keys: Vec<VoxelKey>) -> Result<impl Iterator<Item = String> + Send, ServiceError> {
    let head = serde_json::to_string(&head)
        .map_err(|error| ServiceError::new(Reason::NotWritten, error.to_string()))?;
    let first = format!("{},\"voxels\":[", head.trim_end_matches('}'));
    let pieces = (0..keys.len()).step_by(VOXELS_PER_CHUNK).map(move |start| {
        let end = keys.len().min(start + VOXELS_PER_CHUNK);
        piece(&keys[start..end], start == 0)
    });
    Ok(std::iter::once(first).chain(pieces).chain(std::iter::once("]}".to_owned())))
}

fn piece(keys: &[VoxelKey], first: bool) -> String {
    let mut text = String::with_capacity(keys.len() * 16);
    for (i, key) in keys.iter().enumerate() {
        let [x, y, z] = key.index();
        let comma = if first && i == 0 { "" } else { "," };
        // Writing to a String cannot fail.
        let _ = write!(text, "{comma}[{x},{y},{z}]");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::MapVersion;

    #[test]
    fn the_pieces_are_one_json_object() {
        let version = MapVersion { revision: 3, map_uuid: uuid::Uuid::nil(), content_hash: None };
        for count in [0, 1, VOXELS_PER_CHUNK, VOXELS_PER_CHUNK + 2] {
            let keys: Vec<_> = (0..count as i32).map(|i| VoxelKey::new([i, -1, 2]).unwrap()).collect();
            let head = Head { level: 1, resolution_m: 0.1, version: version.into() };
            let text: String = chunks(head, keys).unwrap().collect();
            let json: serde_json::Value = serde_json::from_str(&text).unwrap();
            let voxels = json["voxels"].as_array().unwrap();
            assert_eq!(voxels.len(), count);
            assert_eq!((json["level"].as_u64(), json["revision"].as_u64()), (Some(1), Some(3)));
            let last = voxels.last().map(|voxel| voxel.to_string());
            assert_eq!(last, count.checked_sub(1).map(|i| format!("[{i},-1,2]")));
        }
    }
}
