//! [`Client`]: a connection to a server, with a method for each call.

use std::time::Duration;

use bytes::{Bytes, BytesMut};
use tonic::Request;
use tonic::transport::Channel;

use super::answers::Answers;
use super::calls::Calls;
use super::connection::Connection;
use super::credentials::Credentials;
use super::elsewhere::Elsewhere;
use super::error::ClientError;
use super::new_map::NewMap;
use super::servers::Servers;
use crate::wire::{pb, restore_pieces};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{
    BlockAnswer, BlockRequest, Deletion, DeletionAnswer, ListingRequest, LocalizationAnswer,
    LocalizationRequest, MapInfo, MapList, ObserversAnswer, ObserversRequest, PointAnswer, PointQuery,
    Reason, ScanAnswer, ScanRequest, ServiceError, TrajectoryAnswer, TrajectoryQuery, Undo, UndoAnswer,
    VoxelListing,
};

/// A connection to a server, or to one of several that serve the same maps.
#[derive(Debug, Clone)]
pub struct Client {
    pub(super) calls: Calls,
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
    /// Several addresses, separated by commas, are those of servers of the same maps. The client uses the first that
    /// answers, and goes on at the next when that one is gone: when it takes no connection (each address is given 3 s
    /// at most), loses one, or says that it goes down. It asks questions again there, and sends a change again if it
    /// was not sent before or has a `scan_id` or `request_id`. Any other change ends with [`ClientError::Lost`]: the
    /// outcome is unknown. A call tries each address once, and those whose connection was lost once more, within one
    /// deadline.
    ///
    /// Where a server does not hold a map and names others that do, the call is sent on there, and so are later ones
    /// about the map: twice at most, with the same key, and only to addresses with the scheme of those that are given
    /// here. A stream of requests is not sent on; the next one goes there.
    ///
    /// Questions that take a `min_revision` wait for the last revision that an answer about the map has named, so that
    /// the map never goes back; listings, blocks, trajectories and descriptions do not.
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
        let elsewhere = Elsewhere::of(url, credentials);
        Ok(Self { calls: Calls::new(Servers::connect(url, credentials).await?, elsewhere) })
    }

    /// The same client, whose calls are sent on to no other server: a node that does not hold a map refuses
    /// (`map_elsewhere`).
    #[must_use]
    pub fn not_sent_on(self) -> Self {
        Self { calls: self.calls.not_sent_on() }
    }

    /// The underlying channel, without the key: for other services of the server, such as gRPC's health protocol.
    pub fn channel(&self) -> Channel {
        self.calls.channel()
    }

    /// Sets a deadline for every call that is not a stream. The server gives up at the deadline, and waits for a
    /// `min_revision` until then.
    pub fn with_timeout(self, timeout: Duration) -> Self {
        Self { calls: self.calls.with_timeout(Some(timeout)) }
    }

    /// Creates a map, and returns its description and whether it is new. A map of that name with the same settings is
    /// no error.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn create_map(&self, map: &MapName, settings: NewMap) -> Result<(MapInfo, bool), ClientError> {
        let message = pb::CreateMapRequest::from((map, settings));
        let send = |on: Connection, request| async move { on.domain(on.maps().create_map(request).await) };
        self.calls.change(map, false, message, send).await
    }

    /// Describes a map.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn map_info(&self, map: &MapName) -> Result<MapInfo, ClientError> {
        let message = pb::GetMapRequest { map: map.to_string() };
        let send = |on: Connection, request| async move { on.domain(on.maps().get_map(request).await) };
        self.calls.ask_about(map, message, send).await
    }

    /// Describes all maps, sorted by name; those that could not be opened with the reason and the remedy.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_maps(&self) -> Result<MapList, ClientError> {
        let send = |on: Connection, request| async move { on.domain(on.maps().list_maps(request).await) };
        self.calls.ask(None, pb::ListMapsRequest {}, send).await
    }

    /// Gives a map another name, which no map has; its uuid, its revision and its robots stay. Watches and changes that
    /// are under way under the former name end with `map_not_found`.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn rename_map(&self, map: &MapName, to: &MapName) -> Result<MapInfo, ClientError> {
        let message = pb::RenameMapRequest { map: map.to_string(), to: to.to_string() };
        let send = |on: Connection, request| async move { on.domain(on.maps().rename_map(request).await) };
        self.calls.change(to, false, message, send).await
    }

    /// Deletes a map, in memory and on disk.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn delete_map(&self, map: &MapName) -> Result<(), ClientError> {
        let message = pb::DeleteMapRequest { map: map.to_string() };
        let send = |on: Connection, request| async move {
            let answer = on.maps().delete_map(request).await;
            answer.map(|_| ()).map_err(|status| on.failure(&status))
        };
        self.calls.change_of_none(map, message, send).await
    }

    /// Returns the map as the bytes of a map file, at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn snapshot_map(&self, map: &MapName) -> Result<Bytes, ClientError> {
        let message = pb::SnapshotMapRequest { map: map.to_string() };
        let read = |on: Connection, request| async move {
            let failure = |status| on.failure(&status);
            let mut pieces = on.maps().snapshot_map(request).await.map_err(failure)?.into_inner();
            let mut file = BytesMut::new();
            while let Some(piece) = pieces.message().await.map_err(failure)? {
                file.extend_from_slice(&piece.data);
            }
            Ok(file.freeze())
        };
        self.calls.with_timeout(None).ask(Some(map), message, read).await
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
        let send = |on: Connection, request: Request<(MapName, Bytes)>| async move {
            let (map, file) = request.into_inner();
            let pieces = tokio_stream::iter(restore_pieces(&map, file, replace));
            on.domain(on.maps().restore_map(pieces).await)
        };
        self.calls.with_timeout(None).change(map, false, (map.clone(), file), send).await
    }

    /// Returns for each point whether its voxel is occupied, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn query_points(&self, map: &MapName, query: PointQuery) -> Result<PointAnswer, ClientError> {
        let message = pb::QueryPointsRequest::from((map, query));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().query_points(request).await) };
        self.calls.question(map, message, send).await
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
        let message = pb::ListVoxelsRequest::from((map, request));
        let read = |on: Connection, request| async move {
            let mut chunks: Answers<VoxelListing> = on.answers(on.occupancy().list_voxels(request).await)?;
            let mut listing = chunks.next().await.unwrap_or_else(|| Err(missing_message("listing")))?;
            while let Some(chunk) = chunks.next().await {
                listing.keys.extend(chunk?.keys);
            }
            Ok(listing)
        };
        self.calls.ask_about(map, message, read).await
    }

    /// Returns a part of a level as it is stored, or the distance of each of its cells from what is occupied, at one
    /// revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn get_block(&self, map: &MapName, request: BlockRequest) -> Result<BlockAnswer, ClientError> {
        let message = pb::GetBlockRequest::from((map, request));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().get_block(request).await) };
        self.calls.ask_about(map, message, send).await
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
        let message = pb::ListObserversRequest::from((map, request));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().list_observers(request).await) };
        self.calls.ask_about(map, message, send).await
    }

    /// Aligns a scan and, where it fits, adds it. A scan that does not align is an answer, not an error.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn insert_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ClientError> {
        let with_id = scan.scan_id.is_some();
        let message = pb::InsertScanRequest::from((map, scan));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().insert_scan(request).await) };
        self.calls.change(map, with_id, message, send).await
    }

    /// Aligns a scan and returns what [`Client::insert_scan`] would; changes nothing.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn align_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ClientError> {
        let message = pb::AlignScanRequest::from((map, scan));
        let send = |on: Connection, request| async move { on.domain(on.mapping().align_scan(request).await) };
        self.calls.ask_about(map, message, send).await
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
        let message = pb::LocalizeRequest::from((map, scan));
        let send = |on: Connection, request| async move { on.domain(on.mapping().localize(request).await) };
        self.calls.ask_about(map, message, send).await
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
        let with_id = deletion.request_id.is_some();
        let message = pb::DeleteVoxelsRequest::from((map, deletion));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().delete_voxels(request).await) };
        self.calls.change(map, with_id, message, send).await
    }

    /// Removes scans from the map; voxels that other scans touched stay.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn undo(&self, map: &MapName, undo: Undo) -> Result<UndoAnswer, ClientError> {
        let with_id = undo.request_id.is_some();
        let message = pb::UndoRequest::from((map, undo));
        let send = |on: Connection, request| async move { on.domain(on.mapping().undo(request).await) };
        self.calls.change(map, with_id, message, send).await
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
        let read = |on: Connection, request| async move {
            let mut pieces: Answers<TrajectoryAnswer> =
                on.answers(on.mapping().stream_trajectory(request).await)?;
            let mut all = pieces.next().await.unwrap_or_else(|| Err(missing_message("trajectory")))?;
            while let Some(piece) = pieces.next().await {
                all.poses.extend(piece?.poses);
            }
            Ok(all)
        };
        self.calls.ask_about(map, pb::StreamTrajectoryRequest::from((map, query)), read).await
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
        let message = pb::GetTrajectoryRequest::from((map, query));
        let send =
            |on: Connection, request| async move { on.domain(on.mapping().get_trajectory(request).await) };
        self.calls.ask_about(map, message, send).await
    }
}

/// The error of a listing without a message; the first message tells the map's revision.
fn missing_message(what: &str) -> ClientError {
    ClientError::Answer(ServiceError::new(Reason::MissingField, format!("the {what} has no message")))
}
