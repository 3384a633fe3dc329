//! Keep-outs: putting, removing and listing them.

use super::client::Client;
use super::connection::Connection;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_service::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut};

impl Client {
    /// Puts a keep-out: a new one, or in the place of the one of its name.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn put_keep_out(&self, map: &MapName, put: PutKeepOut) -> Result<KeepOutAnswer, ClientError> {
        let (with_id, message) = (put.request_id.is_some(), pb::PutKeepOutRequest::from((map, put)));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().put_keep_out(request).await) };
        self.calls.change(map, with_id, message, send).await
    }

    /// Removes a keep-out.
    ///
    /// # Errors
    /// When the map has none of that name, the server refuses, or cannot be reached.
    pub async fn delete_keep_out(
        &self,
        map: &MapName,
        deletion: DeleteKeepOut,
    ) -> Result<KeepOutAnswer, ClientError> {
        let (with_id, message) =
            (deletion.request_id.is_some(), pb::DeleteKeepOutRequest::from((map, deletion)));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().delete_keep_out(request).await) };
        self.calls.change(map, with_id, message, send).await
    }

    /// Lists the keep-outs of a map, by name, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_keep_outs(&self, map: &MapName) -> Result<KeepOutList, ClientError> {
        let message = pb::ListKeepOutsRequest { map: map.to_string() };
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().list_keep_outs(request).await) };
        self.calls.ask_about(map, message, send).await
    }
}
