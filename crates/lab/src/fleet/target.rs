//! The map of a workload on any server.

use uuid::Uuid;

use super::address::{GrpcAddress, HttpAddress};
use super::error::FleetError;
use crate::workload::Workload;
use mrol_client::{Client, NewMap};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapName, MapSettings, RobotName};
use mrol_map::mapping::Guess;
use mrol_map::voxel::{Lattice, VoxelSet};
use mrol_service::{PointCloud, ScanRequest};

/// A map of a workload, under a name that no other map has.
pub(crate) struct Target {
    pub(crate) grpc: GrpcAddress,
    pub(crate) http: Option<HttpAddress>,
    pub(crate) map: MapName,
    pub(crate) resolution_m: f64,
    pub(crate) voxels: usize,
    client: Client,
}

impl Target {
    /// Creates the map on a server and fills it with `workload`.
    pub(crate) async fn make(
        grpc: GrpcAddress,
        http: Option<HttpAddress>,
        workload: Workload,
        settings: MapSettings,
    ) -> Result<Self, FleetError> {
        let client = grpc.connect().await?;
        let map = MapName::new(&format!("bench-{}", Uuid::new_v4())).map_err(FleetError::failed)?;
        let new_map = NewMap {
            resolution_m: settings.resolution_m,
            levels: Some(settings.levels),
            filter: settings.filter.into(),
            moments: Some(settings.moments),
            origin: settings.origin,
        };
        client.create_map(&map, new_map).await?;
        let resolution_m = settings.resolution_m;
        let mut target = Self { grpc, http, map, resolution_m, voxels: 0, client };
        match target.fill(workload).await {
            Ok(()) => Ok(target),
            Err(error) => {
                // The first error is the one that is reported.
                let _ = target.delete().await;
                Err(error)
            }
        }
    }

    /// Sends the voxels as scans of points in their centers.
    async fn fill(&mut self, workload: Workload) -> Result<(), FleetError> {
        let robot = RobotName::new("bench").map_err(FleetError::failed)?;
        let lattice = Lattice::new(workload.resolution_m(), 1).map_err(FleetError::failed)?;
        for voxels in workload.pieces() {
            let scan = ScanRequest {
                guess: Guess::Pose(Pose::identity()),
                at_guess: true,
                strict: true,
                ..ScanRequest::new(robot.clone(), middles(&voxels, &lattice))
            };
            self.voxels += self.client.insert_scan(&self.map, scan).await?.new_voxels;
        }
        Ok(())
    }

    pub(crate) async fn delete(self) -> Result<(), FleetError> {
        Ok(self.client.delete_map(&self.map).await?)
    }
}

fn middles(voxels: &VoxelSet, lattice: &Lattice) -> PointCloud {
    let middle = |voxel| Point::from(nalgebra::Point3::from(lattice.center_m(voxel, 0)));
    voxels.iter().map(middle).collect::<Vec<_>>().into()
}
