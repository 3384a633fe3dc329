//! The Maps service: what operators do.

use bytes::{Bytes, BytesMut};
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::{Adapter, answered, service_of};
use crate::access::Authorized;
use crate::admission::InboundBody;
use crate::map::MapName;
use crate::service::{AllowedMaps, MapList, Reason, ServiceError};
use crate::wire::{self, pb, snapshot_bytes, snapshot_pieces};
use pb::maps_server::Maps;

#[tonic::async_trait]
impl Maps for Adapter {
    type SnapshotMapStream = BoxStream<pb::SnapshotMapResponse>;

    async fn create_map(
        &self,
        request: Request<pb::CreateMapRequest>,
    ) -> Result<Response<pb::CreateMapResponse>, Status> {
        let service = service_of(&request)?;
        let (name, settings) = wire::create_map(request.into_inner(), service.default_filter())?;
        let answer = service.create_map(name, settings).await?;
        Ok(answered(answer.into()))
    }

    async fn get_map(
        &self,
        request: Request<pb::GetMapRequest>,
    ) -> Result<Response<pb::GetMapResponse>, Status> {
        let service = service_of(&request)?;
        let name = map_name(&request.get_ref().map)?;
        let info = service.map_info(&name).await?;
        Ok(answered(info.into()))
    }

    async fn list_maps(
        &self,
        request: Request<pb::ListMapsRequest>,
    ) -> Result<Response<pb::ListMapsResponse>, Status> {
        let service = service_of(&request)?;
        let (maps, unavailable) = (service.list_maps().await?, service.unavailable_maps());
        Ok(answered(MapList { maps, unavailable }.into()))
    }

    async fn delete_map(
        &self,
        request: Request<pb::DeleteMapRequest>,
    ) -> Result<Response<pb::DeleteMapResponse>, Status> {
        let service = service_of(&request)?;
        let name = map_name(&request.get_ref().map)?;
        service.delete_map(&name).await?;
        Ok(Response::new(pb::DeleteMapResponse {}))
    }

    async fn snapshot_map(
        &self,
        request: Request<pb::SnapshotMapRequest>,
    ) -> Result<Response<Self::SnapshotMapStream>, Status> {
        let service = service_of(&request)?;
        let name = map_name(&request.get_ref().map)?;
        let file = service.snapshot_map(&name).await?;
        let kept = self.admission.keep(snapshot_bytes(file.bytes.len()))?;
        let pieces = snapshot_pieces(file).map(move |piece| {
            let _until_sent = &kept;
            Ok(piece)
        });
        Ok(Response::new(Box::pin(tokio_stream::iter(pieces))))
    }

    async fn restore_map(
        &self,
        pieces: Request<Streaming<pb::RestoreMapRequest>>,
    ) -> Result<Response<pb::RestoreMapResponse>, Status> {
        let Authorized { caller, service } = Authorized::of(pieces.extensions())?.clone();
        let most = service.limits().map_file_bytes_max;
        let arrival = InboundBody::of(pieces.extensions())?.clone();
        let (name, replace, file) =
            gather(pieces.into_inner(), &arrival, caller.allowed_maps(), most).await?;
        let info = service.restore_map(name, file, replace).await?;
        Ok(answered(pb::RestoreMapResponse { map: Some(info.into()) }))
    }
}

/// The name, whether it is to be replaced, and the bytes of a file that comes in pieces. One of more than `most` bytes is refused, and one for a map
/// that the caller may not name, before the second piece.
async fn gather(
    mut pieces: Streaming<pb::RestoreMapRequest>,
    arrival: &InboundBody,
    allowed_maps: &AllowedMaps,
    most: usize,
) -> Result<(MapName, bool, Bytes), Status> {
    let mut piece = pieces.message().await?.unwrap_or_default();
    let (name, replace) = (map_name(&piece.map)?, piece.replace);
    allowed_maps.permit(&name)?;
    let mut file = BytesMut::new();
    loop {
        if file.len() + piece.data.len() > most {
            let message = format!("map_file_bytes_max is {most}: the map file is larger");
            return Err(ServiceError::new(Reason::MapFileTooLarge, message).into());
        }
        // Compressed, it came as less.
        arrival.at_least(file.len() + piece.data.len())?;
        file.extend_from_slice(&piece.data);
        match pieces.message().await? {
            Some(next) => piece = next,
            None => return Ok((name, replace, file.freeze())),
        }
    }
}

fn map_name(text: &str) -> Result<MapName, ServiceError> {
    Ok(MapName::new(text)?)
}
