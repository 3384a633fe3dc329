//! The Occupancy service: what planners ask.

use tokio_stream::StreamExt;
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::stream::{Answers, Message};
use super::{Adapter, answered, service_of};
use crate::access::Operation;
use crate::map::MapName;
use crate::service::ServiceError;
use crate::wire::{listing_bytes, pb, voxel_chunks};
use pb::occupancy_server::Occupancy;

#[tonic::async_trait]
impl Occupancy for Adapter {
    type QueryPointsStreamStream = Answers<pb::QueryPointsResponse>;
    type ListVoxelsStream = BoxStream<pb::ListVoxelsResponse>;
    type WatchStream = BoxStream<pb::WatchResponse>;

    async fn query_points(
        &self,
        request: Request<pb::QueryPointsRequest>,
    ) -> Result<Response<pb::QueryPointsResponse>, Status> {
        let service = service_of(&request)?;
        let (map, query) = request.into_inner().try_into()?;
        let answer = service.query_points(&map, query).await?;
        Ok(answered(answer.into()))
    }

    async fn query_points_stream(
        &self,
        requests: Request<Streaming<pb::QueryPointsRequest>>,
    ) -> Result<Response<Self::QueryPointsStreamStream>, Status> {
        let answers = self.answer_in_order(
            Operation::QueryPointsStream,
            requests,
            None,
            |service, request| async move {
                let (map, query) = request.try_into()?;
                let answer = service.query_points(&map, query).await?;
                Ok(answer.into())
            },
        )?;
        Ok(Response::new(answers))
    }

    async fn list_voxels(
        &self,
        request: Request<pb::ListVoxelsRequest>,
    ) -> Result<Response<Self::ListVoxelsStream>, Status> {
        let service = service_of(&request)?;
        let (map, request) = request.into_inner().try_into()?;
        let listing = service.list_voxels(&map, request).await?;
        let kept = self.admission.keep(listing_bytes(listing.keys.len()))?;
        let chunks = voxel_chunks(listing).map(move |chunk| {
            let _until_sent = &kept;
            Ok(chunk)
        });
        Ok(Response::new(Box::pin(tokio_stream::iter(chunks))))
    }

    async fn list_keep_outs(
        &self,
        request: Request<pb::ListKeepOutsRequest>,
    ) -> Result<Response<pb::ListKeepOutsResponse>, Status> {
        let service = service_of(&request)?;
        let map = MapName::new(&request.into_inner().map).map_err(ServiceError::from)?;
        let listing = service.list_keep_outs(&map).await?;
        Ok(answered(listing.into()))
    }

    async fn get_block(
        &self,
        request: Request<pb::GetBlockRequest>,
    ) -> Result<Response<pb::GetBlockResponse>, Status> {
        let service = service_of(&request)?;
        let (map, request) = request.into_inner().try_into()?;
        let answer = service.get_block(&map, request).await?;
        Ok(answered(answer.into()))
    }

    async fn list_observers(
        &self,
        request: Request<pb::ListObserversRequest>,
    ) -> Result<Response<pb::ListObserversResponse>, Status> {
        let service = service_of(&request)?;
        let (map, request) = request.into_inner().try_into()?;
        let answer = service.list_observers(&map, request).await?;
        Ok(answered(answer.into()))
    }

    async fn watch(&self, request: Request<pb::WatchRequest>) -> Result<Response<Self::WatchStream>, Status> {
        let service = service_of(&request)?;
        let (map, request) = request.into_inner().try_into()?;
        let messages = service.watch(&map, request).await?.into_stream(self.admission.told_to_drain());
        Ok(Response::new(Box::pin(messages.map(|message| Ok(message?.into())))))
    }
}

impl Message for pb::QueryPointsRequest {
    fn map_mut(&mut self) -> &mut String {
        &mut self.map
    }
}
