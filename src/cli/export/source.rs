//! What is exported: a map of a file, or of a server.

use std::path::Path;

use super::free_space::FreeSpace;
use crate::cli::remote::ServerOptions;
use mrol::console::CliError;
use mrol_client::Client;
use mrol_map::map::{MapName, MapOrigin, MapSettings};
use mrol_map::voxel::{Lattice, VoxelKey};
use mrol_service::ListingRequest;
use mrol_store::{Disk, Snapshot};

/// A map that is exported.
pub(super) enum Source {
    /// Of a file.
    File(Box<Snapshot>),
    /// Of a server.
    Server(Client, MapName),
}

impl Source {
    /// The map of a file, or of that name on a server.
    ///
    /// # Errors
    /// When the file cannot be read, or the server cannot be reached.
    pub(super) async fn open(
        file: Option<&Path>,
        name: Option<MapName>,
        server: &ServerOptions,
    ) -> Result<Self, CliError> {
        match (file, name) {
            (Some(file), _) => Ok(Self::File(Box::new(Snapshot::read(&Disk::default(), file)?))),
            (None, Some(name)) => Ok(Self::Server(server.connect().await?, name)),
            (None, None) => Err(CliError::usage("a map file or --map is needed")),
        }
    }

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
