//! The Maps service: what operators do.

use bytes::{Bytes, BytesMut};
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::adapter::{Adapter, answered, service_of};
use super::stubs::maps_server::Maps;
use crate::access::Authorized;
use crate::admission::InboundBody;
use mrol_client::wire;
use mrol_client::wire::{InField, pb, snapshot_bytes, snapshot_pieces, status_of};
use mrol_map::map::MapName;
use mrol_service::{AllowedMaps, MapList, Reason, ServiceError};

#[tonic::async_trait]
impl Maps for Adapter {
    type SnapshotMapStream = BoxStream<pb::SnapshotMapResponse>;

    async fn create_map(
        &self,
        request: Request<pb::CreateMapRequest>,
    ) -> Result<Response<pb::CreateMapResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (name, settings) =
            wire::create_map(request.into_inner(), service.default_filter()).map_err(status_of)?;
        let answer = service.create_map(name, settings).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn get_map(
        &self,
        request: Request<pb::GetMapRequest>,
    ) -> Result<Response<pb::GetMapResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let name = map_name(&request.get_ref().map).map_err(status_of)?;
        let info = service.map_info(&name).await.map_err(status_of)?;
        Ok(answered(info.into()))
    }

    async fn list_maps(
        &self,
        request: Request<pb::ListMapsRequest>,
    ) -> Result<Response<pb::ListMapsResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (maps, unavailable) = (service.list_maps().await.map_err(status_of)?, service.unavailable_maps());
        let elsewhere = service.maps_elsewhere();
        Ok(answered(MapList { maps, unavailable, elsewhere }.into()))
    }

    async fn rename_map(
        &self,
        request: Request<pb::RenameMapRequest>,
    ) -> Result<Response<pb::RenameMapResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let name = map_name(&request.get_ref().map).map_err(status_of)?;
        let to = MapName::new(&request.get_ref().to).in_field("to").map_err(status_of)?;
        let info = service.rename_map(&name, &to).await.map_err(status_of)?;
        Ok(answered(pb::RenameMapResponse { map: Some(info.into()) }))
    }

    async fn delete_map(
        &self,
        request: Request<pb::DeleteMapRequest>,
    ) -> Result<Response<pb::DeleteMapResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let name = map_name(&request.get_ref().map).map_err(status_of)?;
        service.delete_map(&name).await.map_err(status_of)?;
        Ok(Response::new(pb::DeleteMapResponse {}))
    }

    async fn snapshot_map(
        &self,
        request: Request<pb::SnapshotMapRequest>,
    ) -> Result<Response<Self::SnapshotMapStream>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let name = map_name(&request.get_ref().map).map_err(status_of)?;
        let file = service.snapshot_map(&name).await.map_err(status_of)?;
        let kept = self.admission.keep(snapshot_bytes(file.bytes.len())).map_err(status_of)?;
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
        let Authorized { caller, service } = Authorized::of(pieces.extensions()).map_err(status_of)?.clone();
        let most = service.limits().map_file_bytes_max;
        let arrival = InboundBody::of(pieces.extensions()).map_err(status_of)?.clone();
        let (name, replace, file) =
            gather(pieces.into_inner(), &arrival, caller.allowed_maps(), most).await?;
        let info = service.restore_map(name, file, replace).await.map_err(status_of)?;
        Ok(answered(pb::RestoreMapResponse { map: Some(info.into()) }))
    }
}

/// The name, whether it is to be replaced, and the bytes of a file that comes in pieces. One of more than `most` bytes
/// is refused, and one for a map that the caller may not name, before the second piece.
async fn gather(
    mut pieces: Streaming<pb::RestoreMapRequest>,
    arrival: &InboundBody,
    allowed_maps: &AllowedMaps,
    most: usize,
) -> Result<(MapName, bool, Bytes), Status> {
    let mut piece = pieces.message().await?.unwrap_or_default();
    let (name, replace) = (map_name(&piece.map).map_err(status_of)?, piece.replace);
    allowed_maps.permit(&name).map_err(status_of)?;
    let mut file = BytesMut::new();
    loop {
        if file.len() + piece.data.len() > most {
            let message = format!("map_file_bytes_max is {most}: the map file is larger");
            return Err(status_of(ServiceError::new(Reason::MapFileTooLarge, message)));
        }
        // Compressed, it came as less.
        arrival.at_least(file.len() + piece.data.len()).map_err(status_of)?;
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
