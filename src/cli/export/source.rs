//! What is exported: a map of a file, or of a server.

use super::free_space::FreeSpace;
use crate::cli::map_source::MapSource;
use mrol::console::CliError;
use mrol::offline::grid_of;
use mrol_client::Client;
use mrol_map::map::{MapName, MapOrigin, MapSettings, MappedScan};
use mrol_map::planning::Grid;
use mrol_map::voxel::{Lattice, VoxelKey};
use mrol_service::{GridQuestion, ListingRequest};
use mrol_store::Snapshot;

/// What is exported of a map.
impl MapSource {
    /// The occupied voxels of a level.
    ///
    /// # Errors
    /// When the map has no such level, or the server refuses.
    pub(super) async fn voxels(&self, level: u32) -> Result<Voxels, CliError> {
        match self {
            Self::File(snapshot) => Voxels::of_snapshot(snapshot, level),
            Self::Server(client, name) => Voxels::of_server(client, name, level).await,
        }
    }

    /// What knows which cells of the level of some voxels are free.
    ///
    /// # Errors
    /// When the settings of a map file are out of range.
    pub(super) fn free_space(&mut self, voxels: &Voxels) -> Result<FreeSpace<'_>, CliError> {
        match self {
            Self::File(snapshot) => {
                // Its voxels are not asked for again.
                let contents = std::mem::take(&mut snapshot.contents);
                FreeSpace::of_contents(snapshot.settings, contents, voxels.level)
            }
            Self::Server(client, name) => {
                Ok(FreeSpace::of_server(client, name, voxels.level, voxels.revision))
            }
        }
    }

    /// The poses of the scans in the map, in the order of acceptance.
    ///
    /// # Errors
    /// When the server refuses.
    pub(super) async fn poses(&self) -> Result<Vec<MappedScan>, CliError> {
        match self {
            Self::File(snapshot) => Ok(snapshot.contents.trajectory.poses().cloned().collect()),
            Self::Server(client, name) => Ok(client.trajectory(name, None).await?.poses),
        }
    }

    /// The map from above.
    ///
    /// # Errors
    /// When no floor is found where heights count from it, or the server refuses.
    pub(super) async fn grid(self, question: GridQuestion) -> Result<Grid, CliError> {
        match self {
            Self::File(snapshot) => grid_of(*snapshot, &question),
            Self::Server(client, name) => Ok(client.whole_grid(&name, question).await?.0),
        }
    }
}

/// The occupied voxels of a level of a map.
pub(super) struct Voxels {
    pub(super) level: u32,
    /// Levels of the map.
    pub(super) levels: u32,
    /// Side of a voxel of the level, meters.
    pub(super) resolution_m: f64,
    pub(super) revision: u64,
    /// Where the map's frame lies in that of a survey.
    pub(super) origin: Option<MapOrigin>,
    /// Each once, ascending: the same map gives the same file, wherever it was read from.
    pub(super) keys: Vec<VoxelKey>,
}

impl Voxels {
    fn of_snapshot(snapshot: &Snapshot, level: u32) -> Result<Self, CliError> {
        let Snapshot { settings, contents, .. } = snapshot;
        if level >= settings.levels {
            let message = format!("--level must be 0 to {}, got {level}", settings.levels - 1);
            return Err(CliError::usage(message));
        }
        let lattice = Lattice::new(settings.resolution_m, settings.levels).map_err(CliError::failed)?;
        let keys = contents.voxels.iter().map(|key| key.ancestor(level)).collect();
        Ok(Self {
            level,
            levels: settings.levels,
            resolution_m: lattice.resolution_m(level),
            revision: contents.revision,
            origin: settings.origin,
            keys: ascending(keys),
        })
    }

    async fn of_server(client: &Client, name: &MapName, level: u32) -> Result<Self, CliError> {
        let MapSettings { origin, levels, .. } = client.map_info(name).await?.settings;
        let listing = client.list_voxels(name, ListingRequest::of(level, None)).await?;
        let (resolution_m, revision) = (listing.resolution_m, listing.version.revision);
        Ok(Self { level, levels, resolution_m, revision, origin, keys: ascending(listing.keys) })
    }

    /// The centers of the voxels in the map frame, meters.
    pub(super) fn centers_m(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + '_ {
        self.keys.iter().map(|key| key.index().map(|i| (f64::from(i) + 0.5) * self.resolution_m))
    }
}

fn ascending(mut keys: Vec<VoxelKey>) -> Vec<VoxelKey> {
    keys.sort_unstable();
    keys.dedup();
    keys
}
