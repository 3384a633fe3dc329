//! Keep-outs: putting, removing and listing them.

use super::client::Client;
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
        let request: tonic::Request<pb::PutKeepOutRequest> = self.request((map, put));
        self.domain(self.connection.mapping().put_keep_out(request).await)
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
        let request: tonic::Request<pb::DeleteKeepOutRequest> = self.request((map, deletion));
        self.domain(self.connection.mapping().delete_keep_out(request).await)
    }

    /// Lists the keep-outs of a map, by name, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_keep_outs(&self, map: &MapName) -> Result<KeepOutList, ClientError> {
        let request = self.request(pb::ListKeepOutsRequest { map: map.to_string() });
        self.domain(self.connection.occupancy().list_keep_outs(request).await)
    }
}
