//! The map that is asked, on whatever server.

use uuid::Uuid;

use super::address::{GrpcAddress, HttpAddress};
use crate::cli::error::CliError;
use crate::cli::lab::bench::workload::MapOptions;
use crate::client::{Client, NewMap};
use crate::geometry::{Point, Pose};
use crate::lab::workload::Workload;
use crate::map::{MapName, RobotName};
use crate::mapping::Guess;
use crate::service::{PointCloud, ScanRequest};
use crate::voxel::{Lattice, VoxelSet};

/// A map of a workload, under a name that no other map has.
pub(in crate::cli::lab::bench) struct Target {
    pub(in crate::cli::lab::bench) grpc: GrpcAddress,
    pub(in crate::cli::lab::bench) http: Option<HttpAddress>,
    pub(in crate::cli::lab::bench) map: MapName,
    pub(in crate::cli::lab::bench) resolution_m: f64,
    pub(in crate::cli::lab::bench) voxels: usize,
    client: Client,
}

impl Target {
    pub(in crate::cli::lab::bench) async fn make(
        grpc: GrpcAddress,
        http: Option<HttpAddress>,
        workload: Workload,
        options: &MapOptions,
    ) -> Result<Self, CliError> {
        let client = grpc.connect().await?;
        let map = MapName::new(&format!("bench-{}", Uuid::new_v4())).map_err(CliError::failed)?;
        let settings = options.settings(workload.resolution_m())?;
        let new_map = NewMap {
            resolution_m: settings.resolution_m,
            levels: Some(settings.levels),
            filter_hashes: Some(settings.filter.hashes),
            filter_bits_per_voxel: Some(settings.filter.bits_per_key),
        };
        client.create_map(&map, new_map).await?;
        let resolution_m = settings.resolution_m;
        let mut target = Self { grpc, http, map, resolution_m, voxels: 0, client };
        match target.fill(workload).await {
            Ok(()) => Ok(target),
            Err(error) => {
                // What went wrong first is what is told.
                let _ = target.delete().await;
                Err(error)
            }
        }
    }

    /// Sends the voxels as scans of points in their middles.
    async fn fill(&mut self, workload: Workload) -> Result<(), CliError> {
        let robot = RobotName::new("bench").map_err(CliError::failed)?;
        let lattice = Lattice::new(workload.resolution_m(), 1).map_err(CliError::failed)?;
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

    pub(in crate::cli::lab::bench) async fn delete(self) -> Result<(), CliError> {
        Ok(self.client.delete_map(&self.map).await?)
    }
}

fn middles(voxels: &VoxelSet, lattice: &Lattice) -> PointCloud {
    let middle = |voxel| Point::from(nalgebra::Point3::from(lattice.center_m(voxel, 0)));
    voxels.iter().map(middle).collect::<Vec<_>>().into()
}
