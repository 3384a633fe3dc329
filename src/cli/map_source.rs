//! The map that a command reads: of a file, or of a server.

use std::path::PathBuf;

use super::remote::ServerOptions;
use mrol::console::{CliError, parse};
use mrol_client::Client;
use mrol_map::map::MapName;
use mrol_store::{Disk, Snapshot};

/// Which map.
#[derive(Debug, clap::Args)]
pub(super) struct MapSourceOptions {
    /// A map file, as `mrol map --out` and `mrol snapshot` write it
    #[arg(value_name = "FILE.mrol", required_unless_present = "name", conflicts_with = "name")]
    pub(super) file: Option<PathBuf>,
    /// Instead of a file: the name of a map on a server
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    name: Option<MapName>,
    #[command(flatten)]
    server: ServerOptions,
}

/// A map of a file, or of a server.
pub(super) enum MapSource {
    /// Of a file.
    File(Box<Snapshot>),
    /// Of a server.
    Server(Box<Client>, MapName),
}

impl MapSourceOptions {
    /// The map, read or within reach.
    ///
    /// # Errors
    /// When the file cannot be read, or the server cannot be reached.
    pub(super) async fn open(&self) -> Result<MapSource, CliError> {
        match (&self.file, &self.name) {
            (Some(file), _) => Ok(MapSource::File(Box::new(Snapshot::read(&Disk::default(), file)?))),
            (None, Some(name)) => Ok(MapSource::Server(Box::new(self.server.connect().await?), name.clone())),
            (None, None) => Err(CliError::usage("a map file or --map is needed")),
        }
    }
}
