//! What became of the scans that robots sent: the last events of a map, and each as it comes.
//!
//! Events are for people who look after robots. They are kept in memory, in bounded number, and a restart forgets them:
//! what is in the map is in its trajectory. Refused scans and failed requests are nowhere else.

use std::sync::Arc;
use std::time::Instant;

use super::event_watch::EventWatch;
use super::submit::Judged;
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{EventsQuery, FailedScan, ScanAnswer, ScanEvent, ScanRequest};
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
        let work = async {
            let map = self.map(map).await?;
            self.at_the_leader(
                &map,
                || std::future::ready(Ok(map.robots.events.list(&query))),
                |leader, call| {
                    let query = query.clone();
                    async move { leader.list_events(&call, query).await }
                },
            )
            .await
        };
        self.observed("ListEvents", Some(map), work, |_| Outcome::Read).await
    }

    /// Tells of the events that [`MapService::list_events`] would list, and then of each as it comes.
    ///
    /// # Errors
    /// `NotFound`.
    pub async fn watch_events(&self, map: &MapName, query: EventsQuery) -> Result<EventWatch, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            EventWatch::begin(self.clone(), map, query).await
        };
        self.observed("WatchEvents", Some(map), work, |_| Outcome::Read).await
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
            // The node that makes it notes it.
            Err(error) if error.reason == Reason::NotLeader => {}
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
