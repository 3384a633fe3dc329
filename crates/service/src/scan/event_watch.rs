//! A watch of the events of a map: of this node's, or of those of the node that leads.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio_stream::{Stream, StreamExt};

use crate::at_the_leader::{Maker, leads_no_more};
use crate::cluster::ForwardedEvents;
use crate::error::ServiceError;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::request::{EventMessage, EventsQuery, ScanEvent};
use crate::watch::{Teller, stream_of};

/// How long a watch waits before it asks again a node that ended its stream.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// A watch of the events of a map. One that falls behind what is kept misses events, and is told of the next. Where the
/// lead of the map moves to another node, so does the watch.
pub struct EventWatch {
    service: MapService,
    map: Arc<HostedMap>,
    /// What comes next: those after the last that was told.
    query: EventsQuery,
    /// Number of the last event that was told: nodes keep events from before, and none is told twice.
    last_told: u64,
    /// Who had the events when `source` was opened.
    maker: Maker,
    source: Source,
    unread_max_s: f64,
}

/// Where the events come from.
enum Source {
    /// The map of this node.
    Here(OwnEvents),
    /// Another node.
    There(ForwardedEvents),
}

/// The events of this node's map, as they come.
struct OwnEvents {
    newest: watch::Receiver<u64>,
    waiting: std::vec::IntoIter<Arc<ScanEvent>>,
    heartbeat: Duration,
    is_greeted: bool,
}

/// What a watch heard of next.
enum Heard {
    Message(EventMessage),
    /// The events are to be asked of whoever leads by now.
    SourceEnded,
}

impl EventWatch {
    /// Begins to watch the events of `map` on behalf of the caller of `service`.
    ///
    /// # Errors
    /// Those of the node that leads, where it is another.
    pub(super) async fn begin(
        service: MapService,
        map: Arc<HostedMap>,
        query: EventsQuery,
    ) -> Result<Self, ServiceError> {
        let maker = service.maker(&map);
        let source = Source::open(&service, &map, &query).await?;
        let unread_max_s = service.limits().watch_unread_max_s;
        Ok(Self { service, map, query, last_told: 0, maker, source, unread_max_s })
    }

    /// The messages as a stream, which ends with its first error: that of `end`, once it comes, or `watch_stalled`
    /// where the client took no message for `watch_unread_max_s`.
    pub fn into_stream(
        self,
        end: impl Future<Output = ServiceError> + Send + 'static,
    ) -> impl Stream<Item = Result<EventMessage, ServiceError>> + Send {
        let unread_max_s = self.unread_max_s;
        stream_of(self, unread_max_s, end)
    }

    async fn hear(&mut self) -> Result<Heard, ServiceError> {
        let Self { service, map, query, last_told, maker, source, .. } = self;
        let next = async {
            match source {
                Source::Here(own) => own.next(map, query, *last_told).await.map(Heard::Message),
                Source::There(events) => match events.next().await {
                    Some(Ok(message)) => Ok(Heard::Message(message)),
                    Some(Err(error)) if !leads_no_more(&error) => Err(error),
                    Some(Err(_)) | None => {
                        tokio::time::sleep(AGAIN_AFTER).await;
                        Ok(Heard::SourceEnded)
                    }
                },
            }
        };
        tokio::select! {
            biased;
            () = map.commit_queue.ended() => Err(map.ended()),
            () = service.maker_changed(map, maker) => Ok(Heard::SourceEnded),
            heard = next => heard,
        }
    }
}

impl Teller for EventWatch {
    type Message = EventMessage;

    /// The next event, or a heartbeat where none comes in a while: at once where there is none yet.
    async fn tell(&mut self) -> Result<EventMessage, ServiceError> {
        loop {
            match self.hear().await? {
                Heard::Message(EventMessage::Event(event)) if event.number <= self.last_told => {}
                Heard::Message(message) => {
                    if let EventMessage::Event(event) = &message {
                        (self.query.since_number, self.last_told) = (event.number, event.number);
                    }
                    return Ok(message);
                }
                Heard::SourceEnded => {
                    self.maker = self.service.maker(&self.map);
                    self.source = Source::open(&self.service, &self.map, &self.query).await?;
                }
            }
        }
    }
}

impl Source {
    async fn open(service: &MapService, map: &HostedMap, query: &EventsQuery) -> Result<Self, ServiceError> {
        let own = || {
            let heartbeat = Duration::from_secs_f64(service.limits().watch_heartbeat_s);
            let (newest, waiting) = (map.robots.events.newest(), Vec::new().into_iter());
            Self::Here(OwnEvents { newest, waiting, heartbeat, is_greeted: false })
        };
        service
            .at_the_leader(
                map,
                || std::future::ready(Ok(own())),
                |leader, call| {
                    let query = query.clone();
                    async move { leader.watch_events(&call, query).await.map(Self::There) }
                },
            )
            .await
    }
}

impl OwnEvents {
    /// The next event that is asked for, of those after `last_told`, or a heartbeat.
    async fn next(
        &mut self,
        map: &HostedMap,
        query: &EventsQuery,
        last_told: u64,
    ) -> Result<EventMessage, ServiceError> {
        let patience = if self.is_greeted { self.heartbeat } else { Duration::ZERO };
        // Events of other robots do not put it off.
        let quiet_until = Instant::now() + patience;
        self.is_greeted = true;
        loop {
            if let Some(event) = self.waiting.next() {
                return Ok(EventMessage::Event(event));
            }
            self.newest.borrow_and_update();
            let mut events = map.robots.events.list(query);
            events.retain(|event| event.number > last_told);
            self.waiting = events.into_iter();
            if self.waiting.len() > 0 {
                continue;
            }
            tokio::select! {
                biased;
                _ = self.newest.changed() => {}
                () = tokio::time::sleep_until(quiet_until.into()) => return Ok(EventMessage::Heartbeat),
            }
        }
    }
}

impl std::fmt::Debug for EventWatch {
    /// A stream has no form to print.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("EventWatch").field("map", &self.map.name).finish_non_exhaustive()
    }
}
