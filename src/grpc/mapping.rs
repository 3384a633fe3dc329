//! The Mapping service: what robots do.

use tokio_stream::StreamExt;
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::adapter::{Adapter, answered, service_of};
use super::former::{Keeping, same_map};
use super::stream::{Answers, Message};
use super::stubs::mapping_server::Mapping;
use crate::access::Operation;
use mrol_client::wire::{pb, status_of};
use mrol_service::{MapService, ServiceError};

#[tonic::async_trait]
impl Mapping for Adapter {
    type InsertScanStreamStream = Answers<pb::InsertScanResponse>;
    type WatchEventsStream = BoxStream<pb::WatchEventsResponse>;
    type StreamTrajectoryStream = BoxStream<pb::StreamTrajectoryResponse>;

    async fn insert_scan(
        &self,
        request: Request<pb::InsertScanRequest>,
    ) -> Result<Response<pb::InsertScanResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, scan) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.insert_scan(&map, scan).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn insert_scan_stream(
        &self,
        requests: Request<Streaming<pb::InsertScanRequest>>,
    ) -> Result<Response<Self::InsertScanStreamStream>, Status> {
        let failed = Some(pb::InsertScanResponse::from as fn(pb::Failure) -> pb::InsertScanResponse);
        let insert = |service: MapService, request: pb::InsertScanRequest, _| async move {
            let (map, scan) = request.try_into()?;
            let answer = service.insert_scan(&map, scan).await?;
            Ok(answer.into())
        };
        let answers = self.answer_in_order(Operation::InsertScanStream, requests, failed, insert)?;
        Ok(Response::new(answers))
    }

    async fn align_scan(
        &self,
        request: Request<pb::AlignScanRequest>,
    ) -> Result<Response<pb::AlignScanResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, scan) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.align_scan(&map, scan).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn localize(
        &self,
        request: Request<pb::LocalizeRequest>,
    ) -> Result<Response<pb::LocalizeResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, scan) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.localize(&map, scan).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn delete_voxels(
        &self,
        request: Request<pb::DeleteVoxelsRequest>,
    ) -> Result<Response<pb::DeleteVoxelsResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, deletion) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.delete_voxels(&map, deletion).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn undo(&self, request: Request<pb::UndoRequest>) -> Result<Response<pb::UndoResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, undo) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.undo(&map, undo).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn put_keep_out(
        &self,
        request: Request<pb::PutKeepOutRequest>,
    ) -> Result<Response<pb::PutKeepOutResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, put) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.put_keep_out(&map, put).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn delete_keep_out(
        &self,
        request: Request<pb::DeleteKeepOutRequest>,
    ) -> Result<Response<pb::DeleteKeepOutResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, deletion) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.delete_keep_out(&map, deletion).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn get_trajectory(
        &self,
        request: Request<pb::GetTrajectoryRequest>,
    ) -> Result<Response<pb::GetTrajectoryResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, query) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.trajectory(&map, query).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn stream_trajectory(
        &self,
        request: Request<pb::StreamTrajectoryRequest>,
    ) -> Result<Response<Self::StreamTrajectoryStream>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, query) = request.into_inner().try_into().map_err(status_of)?;
        let pieces = service.trajectory_pieces(&map, query).await.map_err(status_of)?;
        let kept = self.admission.keep(pieces.memory_bytes()).map_err(status_of)?;
        Ok(Response::new(Box::pin(pieces.into_stream().map(move |piece| {
            let _until_sent = &kept;
            Ok(piece.map_err(status_of)?.into())
        }))))
    }

    async fn list_events(
        &self,
        request: Request<pb::ListEventsRequest>,
    ) -> Result<Response<pb::ListEventsResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, query) = request.into_inner().try_into().map_err(status_of)?;
        let events = service.list_events(&map, query).await.map_err(status_of)?;
        Ok(answered(pb::ListEventsResponse {
            events: events.iter().map(|event| (&**event).into()).collect(),
        }))
    }

    async fn watch_events(
        &self,
        request: Request<pb::WatchEventsRequest>,
    ) -> Result<Response<Self::WatchEventsStream>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, query) = request.into_inner().try_into().map_err(status_of)?;
        let watch = service.watch_events(&map, query).await.map_err(status_of)?;
        let messages = watch.into_stream(self.admission.told_to_drain());
        Ok(Response::new(Box::pin(messages.map(|message| Ok(message.map_err(status_of)?.into())))))
    }
}

impl Message for pb::InsertScanRequest {
    type Former = String;

    fn complete(&mut self, former: &mut String, _: Keeping<'_>) -> Result<(), ServiceError> {
        same_map(&mut self.map, former);
        Ok(())
    }
}
