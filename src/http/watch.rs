//! `GET /v1/maps/{map}/watch?since_revision=&map_uuid=&delta_level=&min=x,y,z&max=x,y,z&viewpoints=`: the changes of
//! a map.
//!
//! The answer is a stream of messages, each the protobuf message `WatchResponse` that gRPC sends (`occupancy.proto`) behind
//! its length in four bytes, little-endian. It ends with a message that says why.

use std::convert::Infallible;

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use tokio_stream::StreamExt;

use super::Adapter;
use super::error::HttpError;
use super::middleware::Service;
use super::params::{Map, Params, RegionParams};
use crate::map::MapName;
use crate::service::{ServiceError, WatchRequest};
use crate::wire::{framed, pb};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WatchParams {
    since_revision: Option<u64>,
    map_uuid: Option<String>,
    delta_level: Option<u32>,
    min: Option<String>,
    max: Option<String>,
    map_from_box: Option<String>,
    size: Option<String>,
    #[serde(default)]
    viewpoints: bool,
}

pub(super) async fn watch(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<WatchParams>,
) -> Result<Response, HttpError> {
    let request = params.request(&map)?;
    let messages = service.watch(&map, request).await?.into_stream(adapter.admission.told_to_drain());
    let mut has_failed = false;
    let messages = messages.map_while(move |message| {
        if has_failed {
            return None;
        }
        has_failed = message.is_err();
        let failure = |error: ServiceError| pb::WatchResponse::from(pb::Failure::from(error));
        let message = message.map_or_else(failure, Into::into);
        Some(Ok::<_, Infallible>(framed(&message)))
    });
    let content_type = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((content_type, Body::from_stream(messages)).into_response())
}

impl WatchParams {
    fn request(self, map: &MapName) -> Result<WatchRequest, ServiceError> {
        let Self { min, max, map_from_box, size, .. } = self;
        let region = RegionParams { min, max, map_from_box, size }.region()?;
        let request = pb::WatchRequest {
            map: map.to_string(),
            since_revision: self.since_revision,
            map_uuid: self.map_uuid.unwrap_or_default(),
            region: region.map(Into::into),
            delta_level: self.delta_level,
            viewpoints: self.viewpoints,
        };
        let (_, request) = request.try_into()?;
        Ok(request)
    }
}
