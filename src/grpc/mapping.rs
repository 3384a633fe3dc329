//! The Mapping service: what robots do.

use tonic::{Request, Response, Status, Streaming};

use super::stream::{Answers, Message};
use super::{Adapter, service_of};
use crate::access::Operation;
use crate::admission::AnswerBytes;
use crate::map::{MapName, RobotName};
use crate::wire::pb;
use pb::mapping_server::Mapping;

#[tonic::async_trait]
impl Mapping for Adapter {
    type InsertScanStreamStream = Answers<pb::InsertScanResponse>;

    async fn insert_scan(
        &self,
        request: Request<pb::InsertScanRequest>,
    ) -> Result<Response<pb::InsertScanResponse>, Status> {
        let service = service_of(&request)?;
        let (map, scan) = request.into_inner().try_into()?;
        let answer = service.insert_scan(&map, scan).await?;
        Ok(Response::new(answer.into()))
    }

    async fn insert_scan_stream(
        &self,
        requests: Request<Streaming<pb::InsertScanRequest>>,
    ) -> Result<Response<Self::InsertScanStreamStream>, Status> {
        let answers =
            self.answer_in_order(Operation::InsertScanStream, requests, |service, request| async move {
                let (map, scan) = request.try_into()?;
                let answer = service.insert_scan(&map, scan).await?;
                Ok(answer.into())
            })?;
        Ok(Response::new(answers))
    }

    async fn align_scan(
        &self,
        request: Request<pb::AlignScanRequest>,
    ) -> Result<Response<pb::AlignScanResponse>, Status> {
        let service = service_of(&request)?;
        let (map, scan) = request.into_inner().try_into()?;
        let answer = service.maps().align_scan(&map, scan).await?;
        let bytes = answer.foreground.as_ref().map_or(0, |foreground| foreground.bitmap.len());
        let mut response = Response::new(answer.into());
        response.extensions_mut().insert(AnswerBytes(bytes));
        Ok(response)
    }

    async fn localize(
        &self,
        request: Request<pb::LocalizeRequest>,
    ) -> Result<Response<pb::LocalizeResponse>, Status> {
        let service = service_of(&request)?;
        let (map, scan) = request.into_inner().try_into()?;
        let answer = service.maps().localize(&map, scan).await?;
        Ok(Response::new(answer.into()))
    }

    async fn delete_voxels(
        &self,
        request: Request<pb::DeleteVoxelsRequest>,
    ) -> Result<Response<pb::DeleteVoxelsResponse>, Status> {
        let service = service_of(&request)?;
        let (map, deletion) = request.into_inner().try_into()?;
        let answer = service.delete_voxels(&map, deletion).await?;
        Ok(Response::new(answer.into()))
    }

    async fn undo_scans(
        &self,
        request: Request<pb::UndoScansRequest>,
    ) -> Result<Response<pb::UndoScansResponse>, Status> {
        let service = service_of(&request)?;
        let (map, undo) = request.into_inner().try_into()?;
        let answer = service.undo_scans(&map, undo).await?;
        Ok(Response::new(answer.into()))
    }

    async fn get_trajectory(
        &self,
        request: Request<pb::GetTrajectoryRequest>,
    ) -> Result<Response<pb::GetTrajectoryResponse>, Status> {
        let service = service_of(&request)?;
        let (map, robot): (MapName, Option<RobotName>) = request.into_inner().try_into()?;
        let answer = service.maps().trajectory(&map, robot.as_ref()).await?;
        Ok(Response::new(answer.into()))
    }
}

impl Message for pb::InsertScanRequest {
    fn map_mut(&mut self) -> &mut String {
        &mut self.map
    }
}
