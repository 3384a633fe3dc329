//! Watching a map.

use super::answers::Answers;
use super::client::Client;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_service::{WatchMessage, WatchRequest};

impl Client {
    /// Tells of a map's changes as they become durable: of the whole state first where the request names no revision,
    /// or one that is out of reach. It goes on until the answers are dropped, the map is deleted or the connection is
    /// lost; [`super::Replica`] goes on after that as well.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn watch(
        &self,
        map: &MapName,
        request: WatchRequest,
    ) -> Result<Answers<WatchMessage>, ClientError> {
        let request = pb::WatchRequest::from((map, request));
        let answers = self.connection.occupancy().watch(request).await;
        self.connection.answers(answers)
    }
}
