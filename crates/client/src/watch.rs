//! Watching a map.

use super::answers::Answers;
use super::client::Client;
use super::connection::Connection;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::geometry::Point;
use mrol_map::map::{Lookup, MapName};
use mrol_service::{PointQuery, WatchMessage, WatchRequest, WatchedSince};

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
        let message = pb::WatchRequest::from((map, request));
        let open = |on: Connection, request| async move { on.answers(on.occupancy().watch(request).await) };
        self.calls.with_timeout(None).ask(Some(map), message, open).await
    }

    /// Waits for one of several servers that has the revision from which a watch goes on: one that is behind would tell
    /// of an older state. Where none has it the watch begins all the same, as after an older data folder was put back.
    pub(super) async fn wait_to_go_on(&self, map: &MapName, since: &WatchedSince) {
        if self.calls.has_several() {
            let query = PointQuery {
                points: vec![Point::new(0.0, 0.0, 0.0)].into(),
                map_from_points: None,
                level: 0,
                lookup: Lookup::Exact,
                min_revision: Some(since.revision),
                map_uuid: Some(since.map_uuid),
                keep_out: false,
            };
            drop(self.query_points(map, query).await);
        }
    }
}
