//! `GET /v1/maps/{map}/events?since_number=&robot=`: what became of the last scans; and `/events/watch`, each as it
//! comes.
//!
//! A watch is a stream of lines, each a JSON document: an event, `{"heartbeat":true}` where there was none in a while,
//! or at the end `{"error": ...}` with the problem document of what ended it.

use std::convert::Infallible;

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Json, Response};
use serde::{Deserialize, Serialize};
use tokio_stream::StreamExt;
use utoipa::{IntoParams, ToSchema};

use crate::http::adapter::Adapter;
use crate::http::error::{HttpError, Problem};
use crate::http::forms::{Map, Params};
use crate::http::middleware::Service;
use crate::json::JsonEvent;
use crate::json::described;
use mrol_map::map::RobotName;
use mrol_service::{EventMessage, EventsQuery, ServiceError};

/// Which events.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsParams {
    /// Events after this number; all where it is 0, or greater than that of the last event.
    #[param(required = false, maximum = 18446744073709551615_u64)]
    #[serde(default)]
    since_number: u64,
    /// The robot; all of them without.
    #[param(value_type = Option<described::RobotName>, inline)]
    robot: Option<String>,
}

/// The last events of a map.
#[derive(Serialize, ToSchema)]
pub(crate) struct EventsResponse {
    /// The oldest first.
    events: Vec<JsonEvent>,
}

/// A line of a watch.
#[derive(Serialize, ToSchema)]
#[serde(untagged)]
enum EventLine {
    /// What became of a scan.
    Event(Box<JsonEvent>),
    /// There was no event in a while.
    Heartbeat {
        /// True.
        heartbeat: bool,
    },
    /// Why the watch ends.
    Failed {
        /// As a failed request would be answered.
        error: Problem,
    },
}

/// Lists what became of the last scans that were sent for insertion.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/events",
    params(EventsParams),
    responses((status = 200, description = "Answered", body = EventsResponse))
)]
pub(crate) async fn list(
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<EventsParams>,
) -> Result<Json<EventsResponse>, HttpError> {
    let events = service.list_events(&map, params.try_into()?).await?;
    Ok(Json(EventsResponse { events: events.iter().map(|event| JsonEvent::from(&**event)).collect() }))
}

/// Tells of the events that a list would have, then of each as it comes, for as long as the client reads.
///
/// Each line is a JSON document. A heartbeat says that there was no event in a while; the last line says why the watch
/// ends.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/events/watch",
    params(EventsParams),
    responses((status = 200, description = "Lines", body = EventLine, content_type = "application/x-ndjson"))
)]
pub(crate) async fn watch(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<EventsParams>,
) -> Result<Response, HttpError> {
    let watch = service.watch_events(&map, params.try_into()?).await?;
    let messages = watch.into_stream(adapter.admission.told_to_drain());
    let lines = messages.map_while(|message| {
        let line = match message {
            Ok(EventMessage::Event(event)) => EventLine::Event(Box::new((&*event).into())),
            Ok(EventMessage::Heartbeat) => EventLine::Heartbeat { heartbeat: true },
            Err(error) => EventLine::Failed { error: error.into() },
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
