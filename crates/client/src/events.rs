//! What became of the scans that robots sent.

use super::answers::Answers;
use super::client::Client;
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
        let request: tonic::Request<pb::ListEventsRequest> = self.request((map, query));
        self.domain(self.connection.mapping().list_events(request).await)
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
        let request = pb::WatchEventsRequest::from((map, query));
        let answers = self.connection.mapping().watch_events(request).await;
        self.connection.answers(answers)
    }
}
