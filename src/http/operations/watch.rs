//! `GET /v1/maps/{map}/watch`: the changes of a map. Parameters: `since_revision`, `map_uuid`, `since_content_hash`,
//! `since_state_hash`, `delta_level`, `min=x,y,z`, `max=x,y,z`, `viewpoints`.
//!
//! The answer is a stream of messages, each the protobuf message `WatchResponse` that gRPC sends (`occupancy.proto`)
//! behind its length in four bytes, little-endian. It ends with a message that says why.

use std::convert::Infallible;

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use tokio_stream::StreamExt;
use utoipa::IntoParams;

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::WatchBytes;
use crate::http::forms::{Map, Numbers3, Numbers7, Params, RegionParams};
use crate::http::middleware::Service;
use mrol_client::wire::{framed, pb};
use mrol_map::map::MapName;
use mrol_map::util::excerpt;
use mrol_service::{Reason, ServiceError, WatchRequest};

/// From where on, and of which part.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct WatchParams {
    /// The last revision that the client was told of; the whole state comes first without.
    since_revision: Option<u64>,
    /// The map that this was a revision of.
    #[param(format = "uuid")]
    map_uuid: Option<String>,
    /// The map's content hash at that revision, as the client was told: where the map had another, the whole state
    /// comes first.
    since_content_hash: Option<String>,
    /// The state hash that was told with that revision, in sixteen hexadecimal digits: the same for keep-outs and
    /// viewpoints too.
    since_state_hash: Option<String>,
    /// Tell of the voxels of this level that came and went; without, of the finest as they were recorded.
    delta_level: Option<u32>,
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
    /// Whether viewpoints of scans are told, too; false without.
    #[serde(default)]
    viewpoints: bool,
}

/// Tells of a map's changes as they become durable, for as long as the client reads.
///
/// The whole state comes first, unless the client names the last revision that it was told of. After
/// `limits.watch_heartbeat_s` without a change comes a heartbeat; the last message says why the watch ends.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/watch",
    params(WatchParams),
    responses((status = 200, description = "Messages", body = WatchBytes, content_type = "application/octet-stream"))
)]
pub(crate) async fn watch(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<WatchParams>,
) -> Result<Response, HttpError> {
    let request = params.request(&map)?;
    let messages = service.watch(&map, request).await?.into_stream(adapter.admission.told_to_drain());
    let messages = messages.map(|message| {
        let failure = |error: ServiceError| pb::WatchResponse::from(pb::Failure::from(error));
        let message = message.map_or_else(failure, Into::into);
        Ok::<_, Infallible>(framed(&message))
    });
    let content_type = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((content_type, Body::from_stream(messages)).into_response())
}

/// A hash as answers in JSON tell it.
fn hash_of(name: &str, digits: &str) -> Result<u64, ServiceError> {
    let refused = || {
        let message = format!("{name} must have sixteen hexadecimal digits, got {:?}", excerpt(digits));
        ServiceError::new(Reason::BadQuery, message)
    };
    let are_digits = digits.len() == 16 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    are_digits.then(|| u64::from_str_radix(digits, 16).ok()).flatten().ok_or_else(refused)
}

impl WatchParams {
    fn request(self, map: &MapName) -> Result<WatchRequest, ServiceError> {
        let Self { min, max, map_from_box, size, .. } = self;
        let region = RegionParams { min, max, map_from_box, size }.region()?;
        let told = |name, digits: Option<String>| digits.map(|digits| hash_of(name, &digits)).transpose();
        let request = pb::WatchRequest {
            map: map.to_string(),
            since_revision: self.since_revision,
            map_uuid: self.map_uuid.unwrap_or_default(),
            region: region.map(Into::into),
            delta_level: self.delta_level,
            viewpoints: self.viewpoints,
            since_content_hash: told("since_content_hash", self.since_content_hash)?,
            since_state_hash: told("since_state_hash", self.since_state_hash)?,
        };
        let (_, request) = request.try_into()?;
        Ok(request)
    }
}
