//! What became of the scans that robots sent: the last events of a map, and each as it comes.
//!
//! Events are for people who look after robots. They are kept in memory, in bounded number, and a restart forgets them:
//! what is in the map is in its trajectory. Refused scans and failed requests are nowhere else.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio_stream::Stream;

use super::submit::Judged;
use crate::error::ServiceError;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{EventMessage, EventsQuery, FailedScan, ScanAnswer, ScanEvent, ScanRequest};
use crate::watch::{Teller, stream_of};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MapName;

/// The word for a scan whose caller went away: no caller is ever told it.
const CALLER_GONE: &str = "caller_gone";

impl MapService {
    /// What became of the last scans that were sent to a map, and of the last of each robot, the oldest first.
    ///
    /// # Errors
    /// `NotFound`.
    pub async fn list_events(
        &self,
        map: &MapName,
        query: EventsQuery,
    ) -> Result<Vec<Arc<ScanEvent>>, ServiceError> {
        let work = async { Ok(self.map(map).await?.robots.events.list(&query)) };
        self.observed("ListEvents", Some(map), work, |_| Outcome::Read).await
    }

    /// Tells of the events that [`MapService::list_events`] would list, and then of each as it comes.
    ///
    /// # Errors
    /// `NotFound`.
    pub async fn watch_events(&self, map: &MapName, query: EventsQuery) -> Result<EventWatch, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            let limits = self.limits();
            let heartbeat = Duration::from_secs_f64(limits.watch_heartbeat_s);
            let unread_max_s = limits.watch_unread_max_s;
            let (newest, waiting) = (map.robots.events.newest(), Vec::new().into_iter());
            Ok(EventWatch { map, query, newest, waiting, heartbeat, is_greeted: false, unread_max_s })
        };
        self.observed("WatchEvents", Some(map), work, |_| Outcome::Read).await
    }
}

/// A watch of the events of a map. One that falls behind what is kept misses events, and is told of the next.
#[derive(Debug)]
pub struct EventWatch {
    map: Arc<HostedMap>,
    /// What comes next: those after the last that was told.
    query: EventsQuery,
    newest: watch::Receiver<u64>,
    waiting: std::vec::IntoIter<Arc<ScanEvent>>,
    heartbeat: Duration,
    is_greeted: bool,
    unread_max_s: f64,
}

impl EventWatch {
    /// The messages as a stream, which ends with its first error: that of `end`, once it comes, or `watch_stalled`
    /// where the client took no message for `watch_unread_max_s`.
    pub fn into_stream(
        self,
        end: impl Future<Output = ServiceError> + Send + 'static,
    ) -> impl Stream<Item = Result<EventMessage, ServiceError>> + Send {
        let unread_max_s = self.unread_max_s;
        stream_of(self, unread_max_s, end)
    }
}

impl Teller for EventWatch {
    type Message = EventMessage;

    /// The next event, or a heartbeat where none comes in a while: at once where there is none yet.
    async fn tell(&mut self) -> Result<EventMessage, ServiceError> {
        let patience = if self.is_greeted { self.heartbeat } else { Duration::ZERO };
        // Events of other robots do not put it off.
        let quiet_until = Instant::now() + patience;
        loop {
            if let Some(event) = self.waiting.next() {
                self.query.since_number = event.number;
                self.is_greeted = true;
                return Ok(EventMessage::Event(event));
            }
            self.newest.borrow_and_update();
            self.waiting = self.map.robots.events.list(&self.query).into_iter();
            if self.waiting.len() > 0 {
                continue;
            }
            tokio::select! {
                biased;
                () = self.map.commit_queue.ended() => return Err(self.map.ended()),
                _ = self.newest.changed() => {}
                () = tokio::time::sleep_until(quiet_until.into()) => {
                    self.is_greeted = true;
                    return Ok(EventMessage::Heartbeat);
                }
            }
        }
    }
}

/// A scan that is not answered yet: dropped, its caller has gone, which is an event as well.
pub(super) struct PendingEvent<'a> {
    map: &'a HostedMap,
    scan: &'a ScanRequest,
    start: Instant,
    most: usize,
}

impl<'a> PendingEvent<'a> {
    /// A scan that has just come; so many events are kept.
    pub(super) fn begin(map: &'a HostedMap, scan: &'a ScanRequest, most: usize) -> Self {
        Self { map, scan, start: Instant::now(), most }
    }

    /// Keeps what became of the scan.
    pub(super) fn end(self, answer: &Result<Judged, ServiceError>) {
        match answer {
            Ok(Judged { answer, guess, sample }) => {
                self.note(*guess, sample.clone(), Ok(answer.clone().into()));
            }
            Err(error) => self.note(None, Vec::new(), Err(error.into())),
        }
        std::mem::forget(self);
    }

    fn note(&self, guess: Option<Pose>, sample: Vec<Point>, answer: Result<Box<ScanAnswer>, FailedScan>) {
        let ScanRequest { robot, session, scan_id, points, .. } = self.scan;
        let event = ScanEvent {
            // Number and time are given where it is kept.
            number: 0,
            time_ns: 0,
            robot: robot.clone(),
            session: session.clone(),
            scan_id: *scan_id,
            points: points.len(),
            duration: self.start.elapsed(),
            guess,
            sample,
            answer,
        };
        self.map.robots.events.note(event, self.most);
    }
}

impl Drop for PendingEvent<'_> {
    fn drop(&mut self) {
        let message =
            "the caller went away before the answer; what was decided by then is in the map all the same";
        self.note(None, Vec::new(), Err(FailedScan { reason: CALLER_GONE.into(), message: message.into() }));
    }
}
