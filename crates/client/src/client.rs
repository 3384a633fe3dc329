//! [`Client`]: a connection to a server, with a method for each call.

use std::time::Duration;

use bytes::{Bytes, BytesMut};
use tonic::transport::Channel;
use tonic::{Request, Response, Status};

use super::connection::Connection;
use super::credentials::Credentials;
use super::error::ClientError;
use super::new_map::NewMap;
use crate::wire::{pb, restore_pieces};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{
    BlockAnswer, BlockRequest, Deletion, DeletionAnswer, ListingRequest, LocalizationAnswer,
    LocalizationRequest, MapInfo, MapList, ObserversAnswer, ObserversRequest, PointAnswer, PointQuery,
    Reason, ScanAnswer, ScanRequest, ServiceError, TrajectoryAnswer, TrajectoryQuery, Undo, UndoAnswer,
    VoxelListing,
};

/// A connection to a server.
#[derive(Debug, Clone)]
pub struct Client {
    pub(super) connection: Connection,
    timeout: Option<Duration>,
}

/// A name for the session of a robot's program that starts, unlike any other: scans are counted from 0 in it.
pub fn new_session() -> SessionName {
    // 32 hexadecimal digits are a name.
    SessionName::new(&uuid::Uuid::new_v4().simple().to_string()).unwrap_or_default()
}

impl Client {
    /// Connects to the gRPC address of a server that asks for no key: `http://127.0.0.1:7334`, or without the scheme;
    /// `https://robot-7:7334`; or `unix:/run/mrol/grpc.sock`, a socket on the same machine.
    ///
    /// # Errors
    /// When the address is not valid, or no server answers there.
    pub async fn connect(url: &str) -> Result<Self, ClientError> {
        Self::connect_with(url, &Credentials::default()).await
    }

    /// Connects as [`Client::connect`] does, with credentials: a key or certificate to show, authorities to trust.
    ///
    /// # Errors
    /// When the address is not valid, no server answers there, or the two do not trust each other.
    pub async fn connect_with(url: &str, credentials: &Credentials) -> Result<Self, ClientError> {
        Ok(Self { connection: Connection::open(url, credentials).await?, timeout: None })
    }

    /// The underlying channel, without the key: for other services of the server, such as gRPC's health protocol.
    pub fn channel(&self) -> Channel {
        self.connection.channel()
    }

    /// Sets a deadline for every call that is not a stream. The server gives up at the deadline, and waits for a
    /// `min_revision` until then.
    pub fn with_timeout(self, timeout: Duration) -> Self {
        Self { timeout: Some(timeout), ..self }
    }

    /// Creates a map, and returns its description and whether it is new. A map of that name with the same settings is
    /// no error.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn create_map(&self, map: &MapName, settings: NewMap) -> Result<(MapInfo, bool), ClientError> {
        let request = self.request((map, settings));
        self.domain(self.connection.maps().create_map(request).await)
    }

    /// Describes a map.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn map_info(&self, map: &MapName) -> Result<MapInfo, ClientError> {
        let request = self.request(pb::GetMapRequest { map: map.to_string() });
        self.domain(self.connection.maps().get_map(request).await)
    }

    /// Describes all maps, sorted by name; those that could not be opened with the reason and the remedy.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_maps(&self) -> Result<MapList, ClientError> {
        let request = self.request(pb::ListMapsRequest {});
        self.domain(self.connection.maps().list_maps(request).await)
    }

    /// Gives a map another name, which no map has; its uuid, its revision and its robots stay. Watches and changes that
    /// are under way under the former name end with `map_not_found`.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn rename_map(&self, map: &MapName, to: &MapName) -> Result<MapInfo, ClientError> {
        let request = self.request(pb::RenameMapRequest { map: map.to_string(), to: to.to_string() });
        self.domain(self.connection.maps().rename_map(request).await)
    }

    /// Deletes a map, in memory and on disk.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn delete_map(&self, map: &MapName) -> Result<(), ClientError> {
        let request = self.request(pb::DeleteMapRequest { map: map.to_string() });
        let answer = self.connection.maps().delete_map(request).await;
        answer.map(|_| ()).map_err(|status| self.connection.failure(&status))
    }

    /// Returns the map as the bytes of a map file, at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn snapshot_map(&self, map: &MapName) -> Result<Bytes, ClientError> {
        let request = Request::new(pb::SnapshotMapRequest { map: map.to_string() });
        let failure = |status| self.connection.failure(&status);
        let mut pieces = self.connection.maps().snapshot_map(request).await.map_err(failure)?.into_inner();
        let mut file = BytesMut::new();
        while let Some(piece) = pieces.message().await.map_err(failure)? {
            file.extend_from_slice(&piece.data);
        }
        Ok(file.freeze())
    }

    /// Creates a map from a map file. The map gets a new uuid.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn restore_map(&self, map: &MapName, file: Bytes) -> Result<MapInfo, ClientError> {
        self.restore(map, file, false).await
    }

    /// Restores a map under a name that may be in use. The map that was there is kept as `NAME-replaced-REVISION` until
    /// it is deleted.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn replace_map(&self, map: &MapName, file: Bytes) -> Result<MapInfo, ClientError> {
        self.restore(map, file, true).await
    }

    async fn restore(&self, map: &MapName, file: Bytes, replace: bool) -> Result<MapInfo, ClientError> {
        let pieces = tokio_stream::iter(restore_pieces(map, file, replace));
        self.domain(self.connection.maps().restore_map(pieces).await)
    }

    /// Returns for each point whether its voxel is occupied, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn query_points(&self, map: &MapName, query: PointQuery) -> Result<PointAnswer, ClientError> {
        let request = self.request((map, query));
        self.domain(self.connection.occupancy().query_points(request).await)
    }

    /// Lists the occupied voxels of a level, in a region or everywhere, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_voxels(
        &self,
        map: &MapName,
        request: ListingRequest,
    ) -> Result<VoxelListing, ClientError> {
        let request = self.request((map, request));
        let chunks = self.connection.occupancy().list_voxels(request).await;
        let mut chunks = self.connection.answers::<_, VoxelListing>(chunks)?;
        let mut listing = chunks.next().await.unwrap_or_else(|| Err(missing_message("listing")))?;
        while let Some(chunk) = chunks.next().await {
            listing.keys.extend(chunk?.keys);
        }
        Ok(listing)
    }

    /// Returns a part of a level as it is stored, or the distance of each of its cells from what is occupied, at one
    /// revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn get_block(&self, map: &MapName, request: BlockRequest) -> Result<BlockAnswer, ClientError> {
        let request = self.request((map, request));
        self.domain(self.connection.occupancy().get_block(request).await)
    }

    /// Lists the scans that touched a voxel and were not undone, newest first, as far back as the journal reaches.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_observers(
        &self,
        map: &MapName,
        request: ObserversRequest,
    ) -> Result<ObserversAnswer, ClientError> {
        let request = self.request((map, request));
        self.domain(self.connection.occupancy().list_observers(request).await)
    }

    /// Aligns a scan and, where it fits, adds it. A scan that does not align is an answer, not an error.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn insert_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ClientError> {
        let request = self.request((map, scan));
        self.domain(self.connection.mapping().insert_scan(request).await)
    }

    /// Aligns a scan and returns what [`Client::insert_scan`] would; changes nothing.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn align_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ClientError> {
        let request = self.request((map, scan));
        self.domain(self.connection.mapping().align_scan(request).await)
    }

    /// Finds where in the map a scan was taken, without a guess. A scan that fits nowhere is an answer, not an error.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn localize(
        &self,
        map: &MapName,
        scan: LocalizationRequest,
    ) -> Result<LocalizationAnswer, ClientError> {
        let request = self.request((map, scan));
        self.domain(self.connection.mapping().localize(request).await)
    }

    /// Deletes voxels, with all their descendants.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn delete_voxels(
        &self,
        map: &MapName,
        deletion: Deletion,
    ) -> Result<DeletionAnswer, ClientError> {
        let request = self.request((map, deletion));
        self.domain(self.connection.mapping().delete_voxels(request).await)
    }

    /// Removes scans from the map; voxels that other scans touched stay.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn undo(&self, map: &MapName, undo: Undo) -> Result<UndoAnswer, ClientError> {
        let request = self.request((map, undo));
        self.domain(self.connection.mapping().undo(request).await)
    }

    /// Returns the poses of the accepted scans, of one robot or of all robots, all pages at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn trajectory(
        &self,
        map: &MapName,
        robot: Option<&RobotName>,
    ) -> Result<TrajectoryAnswer, ClientError> {
        let query = TrajectoryQuery { robot: robot.cloned(), ..TrajectoryQuery::default() };
        let pieces = self.connection.mapping().stream_trajectory(self.request((map, query))).await;
        let mut pieces = self.connection.answers::<_, TrajectoryAnswer>(pieces)?;
        let mut all = pieces.next().await.unwrap_or_else(|| Err(missing_message("trajectory")))?;
        while let Some(piece) = pieces.next().await {
            all.poses.extend(piece?.poses);
        }
        Ok(all)
    }

    /// Returns one page of the poses of the accepted scans; the answer says where the next page begins.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn trajectory_page(
        &self,
        map: &MapName,
        query: TrajectoryQuery,
    ) -> Result<TrajectoryAnswer, ClientError> {
        let request = self.request((map, query));
        self.domain(self.connection.mapping().get_trajectory(request).await)
    }

    pub(super) fn request<M>(&self, message: impl Into<M>) -> Request<M> {
        let mut request = Request::new(message.into());
        if let Some(timeout) = self.timeout {
            request.set_timeout(timeout);
        }
        request
    }

    pub(super) fn domain<M, T>(&self, answer: Result<Response<M>, Status>) -> Result<T, ClientError>
    where
        M: TryInto<T, Error = ServiceError>,
    {
        let answer = answer.map_err(|status| self.connection.failure(&status))?;
        answer.into_inner().try_into().map_err(ClientError::Answer)
    }
}

/// The error of a listing without a message; the first message tells the map's revision.
fn missing_message(what: &str) -> ClientError {
    ClientError::Answer(ServiceError::new(Reason::MissingField, format!("the {what} has no message")))
}
