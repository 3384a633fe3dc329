//! The Maps service: what operators do.

use bytes::{Bytes, BytesMut};
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::Adapter;
use crate::map::MapName;
use crate::service::ServiceError;
use crate::wire::{self, pb, snapshot_pieces};
use pb::maps_server::Maps;

#[tonic::async_trait]
impl Maps for Adapter {
    type SnapshotMapStream = BoxStream<pb::SnapshotMapResponse>;

    async fn create_map(
        &self,
        request: Request<pb::CreateMapRequest>,
    ) -> Result<Response<pb::CreateMapResponse>, Status> {
        let service = self.service.maps();
        let (name, settings) = wire::create_map(request.into_inner(), service.default_filter())?;
        let answer = service.create_map(name, settings).await?;
        Ok(Response::new(answer.into()))
    }

    async fn get_map(
        &self,
        request: Request<pb::GetMapRequest>,
    ) -> Result<Response<pb::GetMapResponse>, Status> {
        let name = map_name(&request.get_ref().map)?;
        let info = self.service.maps().map_info(&name).await?;
        Ok(Response::new(info.into()))
    }

    async fn list_maps(
        &self,
        _: Request<pb::ListMapsRequest>,
    ) -> Result<Response<pb::ListMapsResponse>, Status> {
        let maps = self.service.maps().list_maps().await?;
        Ok(Response::new(maps.into()))
    }

    async fn delete_map(
        &self,
        request: Request<pb::DeleteMapRequest>,
    ) -> Result<Response<pb::DeleteMapResponse>, Status> {
        let name = map_name(&request.get_ref().map)?;
        self.service.maps().delete_map(&name).await?;
        Ok(Response::new(pb::DeleteMapResponse {}))
    }

    async fn snapshot_map(
        &self,
        request: Request<pb::SnapshotMapRequest>,
    ) -> Result<Response<Self::SnapshotMapStream>, Status> {
        let name = map_name(&request.get_ref().map)?;
        let file = self.service.maps().snapshot_map(&name).await?;
        let held = self.lifecycle.hold();
        let pieces = snapshot_pieces(file).map(move |piece| {
            let _until_sent = &held;
            Ok(piece)
        });
        Ok(Response::new(Box::pin(tokio_stream::iter(pieces))))
    }

    async fn restore_map(
        &self,
        pieces: Request<Streaming<pb::RestoreMapRequest>>,
    ) -> Result<Response<pb::RestoreMapResponse>, Status> {
        let service = self.service.maps();
        let (name, file) = gather(pieces.into_inner(), service.limits().map_file_bytes_max).await?;
        let info = service.restore_map(name, file).await?;
        Ok(Response::new(pb::RestoreMapResponse { map: Some(info.into()) }))
    }
}

/// The name and the bytes of a file that comes in pieces; one of more than `most` bytes is refused.
async fn gather(
    mut pieces: Streaming<pb::RestoreMapRequest>,
    most: usize,
) -> Result<(MapName, Bytes), Status> {
    let (mut map, mut file) = (String::new(), BytesMut::new());
    while let Some(piece) = pieces.message().await? {
        if map.is_empty() {
            map = piece.map;
        }
        if file.len() + piece.data.len() > most {
            let message = format!("map_file_bytes_max is {most}: the map file is larger");
            return Err(ServiceError::invalid("map_file_too_large", message).into());
        }
        file.extend_from_slice(&piece.data);
    }
    Ok((map_name(&map)?, file.freeze()))
}

fn map_name(text: &str) -> Result<MapName, ServiceError> {
    Ok(MapName::new(text)?)
}
