//! What became of the scans that robots sent.

use super::answers::Answers;
use super::client::Client;
use super::connection::Connection;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_service::{EventMessage, EventsQuery, ScanEvent};

impl Client {
    /// Returns what became of the last scans that were sent to a map, and of the last of each robot, the oldest first.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_events(
        &self,
        map: &MapName,
        query: EventsQuery,
    ) -> Result<Vec<ScanEvent>, ClientError> {
        let message = pb::ListEventsRequest::from((map, query));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().list_events(request).await) };
        self.calls.ask(Some(map), message, send).await
    }

    /// Tells of the events that [`Client::list_events`] would return, then of each as it comes. It goes on until the
    /// answers are dropped, the map is deleted or the connection is lost.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn watch_events(
        &self,
        map: &MapName,
        query: EventsQuery,
    ) -> Result<Answers<EventMessage>, ClientError> {
        let message = pb::WatchEventsRequest::from((map, query));
        let open =
            |on: Connection, request| async move { on.answers(on.mapping().watch_events(request).await) };
        self.calls.with_timeout(None).ask(Some(map), message, open).await
    }
}
