//! The Occupancy service: what planners ask.

use tokio_stream::StreamExt;
use tonic::codegen::BoxStream;
use tonic::{Request, Response, Status, Streaming};

use super::adapter::{Adapter, answered, service_of};
use super::former::{Keeping, same_map};
use super::stream::{Answers, Message};
use super::stubs::occupancy_server::Occupancy;
use crate::access::Operation;
use mrol_client::wire::{listing_bytes, pb, status_of, voxel_chunks};
use mrol_map::map::MapName;
use mrol_service::{
    ClassifyQuestion, FrontierQuestion, GridQuestion, MotionCheck, NearestQuestion, PoseCheck, RayQuestion,
    ServiceError, SphereCheck,
};

#[tonic::async_trait]
impl Occupancy for Adapter {
    type QueryPointsStreamStream = Answers<pb::QueryPointsResponse>;
    type ListVoxelsStream = BoxStream<pb::ListVoxelsResponse>;
    type CheckPosesStreamStream = Answers<pb::CheckPosesResponse>;
    type CheckSpheresStreamStream = Answers<pb::CheckSpheresResponse>;
    type CheckMotionsStreamStream = Answers<pb::CheckMotionsResponse>;
    type CastRaysStreamStream = Answers<pb::CastRaysResponse>;
    type FindNearestStreamStream = Answers<pb::FindNearestResponse>;
    type ClassifyPointsStreamStream = Answers<pb::ClassifyPointsResponse>;
    type WatchStream = BoxStream<pb::WatchResponse>;
    type StreamGridStream = BoxStream<pb::GridTile>;

    async fn query_points(
        &self,
        request: Request<pb::QueryPointsRequest>,
    ) -> Result<Response<pb::QueryPointsResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, query) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.query_points(&map, query).await.map_err(status_of)?;
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
            |service, request, _| async move {
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
        let service = service_of(&request).map_err(status_of)?;
        let (map, request) = request.into_inner().try_into().map_err(status_of)?;
        let listing = service.list_voxels(&map, request).await.map_err(status_of)?;
        let kept = self.admission.keep(listing_bytes(listing.keys.len())).map_err(status_of)?;
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
        let service = service_of(&request).map_err(status_of)?;
        let map = MapName::new(&request.into_inner().map).map_err(ServiceError::from).map_err(status_of)?;
        let listing = service.list_keep_outs(&map).await.map_err(status_of)?;
        Ok(answered(listing.into()))
    }

    async fn get_block(
        &self,
        request: Request<pb::GetBlockRequest>,
    ) -> Result<Response<pb::GetBlockResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, request) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.get_block(&map, request).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn list_observers(
        &self,
        request: Request<pb::ListObserversRequest>,
    ) -> Result<Response<pb::ListObserversResponse>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, request) = request.into_inner().try_into().map_err(status_of)?;
        let answer = service.list_observers(&map, request).await.map_err(status_of)?;
        Ok(answered(answer.into()))
    }

    async fn watch(&self, request: Request<pb::WatchRequest>) -> Result<Response<Self::WatchStream>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, request) = request.into_inner().try_into().map_err(status_of)?;
        let messages = service
            .watch(&map, request)
            .await
            .map_err(status_of)?
            .into_stream(self.admission.told_to_drain());
        Ok(Response::new(Box::pin(messages.map(|message| Ok(message.map_err(status_of)?.into())))))
    }

    async fn check_poses(
        &self,
        request: Request<pb::CheckPosesRequest>,
    ) -> Result<Response<pb::CheckPosesResponse>, Status> {
        self.ask::<PoseCheck, _, _>(request).await
    }

    async fn check_poses_stream(
        &self,
        requests: Request<Streaming<pb::CheckPosesRequest>>,
    ) -> Result<Response<Self::CheckPosesStreamStream>, Status> {
        self.ask_in_order::<PoseCheck, _, _>(Operation::CheckPosesStream, requests)
    }

    async fn check_spheres(
        &self,
        request: Request<pb::CheckSpheresRequest>,
    ) -> Result<Response<pb::CheckSpheresResponse>, Status> {
        self.ask::<SphereCheck, _, _>(request).await
    }

    async fn check_spheres_stream(
        &self,
        requests: Request<Streaming<pb::CheckSpheresRequest>>,
    ) -> Result<Response<Self::CheckSpheresStreamStream>, Status> {
        self.ask_in_order::<SphereCheck, _, _>(Operation::CheckSpheresStream, requests)
    }

    async fn check_motions(
        &self,
        request: Request<pb::CheckMotionsRequest>,
    ) -> Result<Response<pb::CheckMotionsResponse>, Status> {
        self.ask::<MotionCheck, _, _>(request).await
    }

    async fn check_motions_stream(
        &self,
        requests: Request<Streaming<pb::CheckMotionsRequest>>,
    ) -> Result<Response<Self::CheckMotionsStreamStream>, Status> {
        self.ask_in_order::<MotionCheck, _, _>(Operation::CheckMotionsStream, requests)
    }

    async fn cast_rays(
        &self,
        request: Request<pb::CastRaysRequest>,
    ) -> Result<Response<pb::CastRaysResponse>, Status> {
        self.ask::<RayQuestion, _, _>(request).await
    }

    async fn cast_rays_stream(
        &self,
        requests: Request<Streaming<pb::CastRaysRequest>>,
    ) -> Result<Response<Self::CastRaysStreamStream>, Status> {
        self.ask_in_order::<RayQuestion, _, _>(Operation::CastRaysStream, requests)
    }

    async fn find_nearest(
        &self,
        request: Request<pb::FindNearestRequest>,
    ) -> Result<Response<pb::FindNearestResponse>, Status> {
        self.ask::<NearestQuestion, _, _>(request).await
    }

    async fn find_nearest_stream(
        &self,
        requests: Request<Streaming<pb::FindNearestRequest>>,
    ) -> Result<Response<Self::FindNearestStreamStream>, Status> {
        self.ask_in_order::<NearestQuestion, _, _>(Operation::FindNearestStream, requests)
    }

    async fn classify_points(
        &self,
        request: Request<pb::ClassifyPointsRequest>,
    ) -> Result<Response<pb::ClassifyPointsResponse>, Status> {
        self.ask::<ClassifyQuestion, _, _>(request).await
    }

    async fn classify_points_stream(
        &self,
        requests: Request<Streaming<pb::ClassifyPointsRequest>>,
    ) -> Result<Response<Self::ClassifyPointsStreamStream>, Status> {
        self.ask_in_order::<ClassifyQuestion, _, _>(Operation::ClassifyPointsStream, requests)
    }

    async fn list_frontiers(
        &self,
        request: Request<pb::ListFrontiersRequest>,
    ) -> Result<Response<pb::ListFrontiersResponse>, Status> {
        self.ask::<FrontierQuestion, _, _>(request).await
    }

    async fn project_grid(
        &self,
        request: Request<pb::ProjectGridRequest>,
    ) -> Result<Response<pb::ProjectGridResponse>, Status> {
        self.ask::<GridQuestion, _, _>(request).await
    }

    async fn stream_grid(
        &self,
        request: Request<pb::ProjectGridRequest>,
    ) -> Result<Response<Self::StreamGridStream>, Status> {
        let service = service_of(&request).map_err(status_of)?;
        let (map, question) = request.into_inner().try_into().map_err(status_of)?;
        let tiles = service.grid_tiles(&map, question).await.map_err(status_of)?;
        let tiles = tiles.into_stream(self.admission.told_to_drain());
        Ok(Response::new(Box::pin(tiles.map(|tile| Ok(tile.map_err(status_of)?.into())))))
    }
}

impl Message for pb::QueryPointsRequest {
    type Former = String;

    fn complete(&mut self, former: &mut String, _: Keeping<'_>) -> Result<(), ServiceError> {
        same_map(&mut self.map, former);
        Ok(())
    }
}
