//! Which server, and which map there.

use crate::client::Client;
use crate::map::MapName;

use super::error::CliError;
use super::parse;

#[derive(Debug, clap::Args)]
pub(super) struct ServerOptions {
    /// The gRPC address of the server, or unix:PATH
    #[arg(long, env = "MROL_SERVER", default_value = "http://127.0.0.1:7334", value_name = "URL")]
    server: String,
}

impl ServerOptions {
    pub(super) fn url(&self) -> &str {
        &self.server
    }

    pub(super) async fn connect(&self) -> Result<Client, CliError> {
        Ok(Client::connect(&self.server).await?)
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct MapOptions {
    /// The map's name on the server
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    pub(super) name: MapName,
    #[command(flatten)]
    pub(super) server: ServerOptions,
}
