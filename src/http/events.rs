//! `GET /v1/maps/{map}/events?since_number=&robot=`: what became of the last scans; and `/events/watch`, each as it comes.
//!
//! A watch is a stream of lines, each a JSON document: an event, `{}` where there was none in a while, or at the end
//! `{"error": ...}` with the problem document of what ended it.

use std::convert::Infallible;

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Json, Response};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tokio_stream::StreamExt;

use super::Adapter;
use super::error::{HttpError, problem};
use super::middleware::Service;
use super::params::{Map, Params};
use crate::map::RobotName;
use crate::service::{EventMessage, EventsQuery, ServiceError};
use crate::wire::json::JsonEvent;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EventsParams {
    #[serde(default)]
    since_number: u64,
    robot: Option<String>,
}

/// The last events of a map.
#[derive(Serialize)]
pub(super) struct EventsResponse {
    events: Vec<JsonEvent>,
}

/// A line of a watch.
#[derive(Serialize)]
#[serde(untagged)]
enum Line {
    Event(Box<JsonEvent>),
    Heartbeat {},
    Failed { error: Value },
}

pub(super) async fn list(
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<EventsParams>,
) -> Result<Json<EventsResponse>, HttpError> {
    let events = service.list_events(&map, params.try_into()?).await?;
    Ok(Json(EventsResponse { events: events.iter().map(|event| JsonEvent::from(&**event)).collect() }))
}

pub(super) async fn watch(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<EventsParams>,
) -> Result<Response, HttpError> {
    let watch = service.watch_events(&map, params.try_into()?).await?;
    let messages = watch.into_stream(adapter.admission.told_to_drain());
    let mut has_failed = false;
    let lines = messages.map_while(move |message| {
        if has_failed {
            return None;
        }
        has_failed = message.is_err();
        let line = match message {
            Ok(EventMessage::Event(event)) => Line::Event(Box::new((&event).into())),
            Ok(EventMessage::Heartbeat) => Line::Heartbeat {},
            Err(error) => Line::Failed { error: problem(error) },
        };
        serde_json::to_string(&line).ok().map(|line| Ok::<_, Infallible>(line + "\n"))
    });
    let content_type = [(header::CONTENT_TYPE, "application/x-ndjson")];
    Ok((content_type, Body::from_stream(lines)).into_response())
}

impl TryFrom<EventsParams> for EventsQuery {
    type Error = ServiceError;

    fn try_from(EventsParams { since_number, robot }: EventsParams) -> Result<Self, ServiceError> {
        let robot = robot.map(|name| RobotName::new(&name)).transpose()?;
        Ok(Self { since_number, robot })
    }
}
