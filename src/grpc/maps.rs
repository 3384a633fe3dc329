//! The Maps service: what operators do.

use tonic::{Request, Response, Status};

use super::Adapter;
use crate::map::MapName;
use crate::service::ServiceError;
use crate::wire::{self, pb};
use pb::maps_server::Maps;

#[tonic::async_trait]
impl Maps for Adapter {
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
}

fn map_name(text: &str) -> Result<MapName, ServiceError> {
    Ok(MapName::new(text)?)
}
