//! What an attack is aimed at.

use crate::fleet::address::{GrpcAddress, HttpAddress};
use crate::fleet::error::FleetError;
use crate::fleet::http::HttpConnection;
use mrol::console::parse;
use mrol_client::{Client, Credentials};
use mrol_map::map::MapName;

/// A server with its maps, and the keys to show there.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Aim {
    /// Address of gRPC
    #[arg(long)]
    pub(crate) grpc: String,
    /// URL of HTTP
    #[arg(long)]
    pub(crate) http: String,
    /// The map that honest callers use
    #[arg(long, value_parser = parse::map_name)]
    pub(crate) shared: MapName,
    /// A large map
    #[arg(long, value_parser = parse::map_name)]
    pub(crate) large: MapName,
    /// A map of the attackers' own
    #[arg(long, value_parser = parse::map_name)]
    pub(crate) own: MapName,
    /// Secret of the key for reading
    #[arg(long, env = Self::READER, hide_env_values = true)]
    pub(crate) reader: String,
    /// Secret of the key for insertions
    #[arg(long, env = Self::INSERTER, hide_env_values = true)]
    pub(crate) inserter: String,
}

impl Aim {
    /// Variable with the secret of the key for reading.
    pub(crate) const READER: &str = "MROL_LAB_READER";
    /// Variable with the secret of the key for insertions.
    pub(crate) const INSERTER: &str = "MROL_LAB_INSERTER";

    /// A connection with the key for insertions, or that for reading.
    pub(super) async fn connect(&self, inserts: bool) -> Result<Client, FleetError> {
        let secret = if inserts { &self.inserter } else { &self.reader };
        let credentials = Credentials::default().with_key(secret)?;
        GrpcAddress { url: self.grpc.clone(), credentials }.connect().await
    }

    /// A connection for reading what is at `path`.
    pub(super) fn at(&self, path: &str) -> Result<HttpConnection, FleetError> {
        HttpConnection::to(&HttpAddress::new(&format!("{}{path}", self.http), Some(&self.reader))?)
    }
}
