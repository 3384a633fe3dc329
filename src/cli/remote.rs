//! Options of commands that call a server: address, map and credentials.

use mrol_client::Client;
use mrol_map::map::MapName;

use mrol::console::parse;
use mrol::console::{CliError, CredentialOptions};

#[derive(Debug, clap::Args)]
pub(super) struct ServerOptions {
    /// The gRPC address of the server: http://, https:// or unix:PATH; several of servers of the same maps, with commas
    /// between them: the first that answers
    #[arg(long, env = "MROL_SERVER", default_value = "http://127.0.0.1:7334", value_name = "URL")]
    server: String,
    #[command(flatten)]
    credentials: CredentialOptions,
}

impl ServerOptions {
    pub(super) async fn connect(&self) -> Result<Client, CliError> {
        Ok(Client::connect_with(&self.server, &self.credentials.read()?).await?)
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
