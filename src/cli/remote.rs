//! Options of commands that call a server: address, map and credentials.

use std::fs;
use std::path::{Path, PathBuf};

use mrol_client::{Client, Credentials};
use mrol_map::map::MapName;

use crate::console::CliError;
use crate::console::parse;

/// Heading of these options in a command's help.
const HEADING: &str = "Access";

#[derive(Debug, clap::Args)]
pub(super) struct ServerOptions {
    /// The gRPC address of the server: http://, https:// or unix:PATH
    #[arg(long, env = "MROL_SERVER", default_value = "http://127.0.0.1:7334", value_name = "URL")]
    server: String,
    #[command(flatten)]
    credentials: CredentialOptions,
}

/// Options of the credentials: what is shown to a server, and which server is trusted.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct CredentialOptions {
    /// The secret of a key. Other users of this machine can see options: prefer the variable or a file
    #[arg(long, help_heading = HEADING, env = "MROL_KEY", value_name = "SECRET", hide_env_values = true)]
    key: Option<Hidden>,
    /// A file with the secret of a key
    #[arg(long, help_heading = HEADING, env = "MROL_KEY_FILE", value_name = "FILE", conflicts_with = "key")]
    key_file: Option<PathBuf>,
    /// Certificates (PEM) of the authorities that may sign the server's certificate [default: those that this system
    /// trusts]
    #[arg(long, help_heading = HEADING, env = "MROL_CA", value_name = "FILE")]
    ca: Option<PathBuf>,
    /// The certificate (PEM) to show to a server that asks for one
    #[arg(long, help_heading = HEADING, env = "MROL_CLIENT_CERT", value_name = "FILE", requires = "client_key")]
    client_cert: Option<PathBuf>,
    /// The private key (PEM) of the client's certificate
    #[arg(long, help_heading = HEADING, env = "MROL_CLIENT_KEY", value_name = "FILE", requires = "client_cert")]
    client_key: Option<PathBuf>,
}

/// A text that is never printed.
#[derive(Clone)]
struct Hidden(String);

impl ServerOptions {
    pub(super) async fn connect(&self) -> Result<Client, CliError> {
        Ok(Client::connect_with(&self.server, &self.credentials.read()?).await?)
    }
}

impl CredentialOptions {
    /// Reads the credentials that the options name.
    pub fn read(&self) -> Result<Credentials, CliError> {
        let mut credentials = Credentials::default();
        if let Some(secret) = self.secret()? {
            credentials = credentials.with_key(&secret)?;
        }
        if let Some(ca) = &self.ca {
            credentials = credentials.with_server_ca(&read(ca)?)?;
        }
        if let (Some(certificate), Some(key)) = (&self.client_cert, &self.client_key) {
            credentials = credentials.with_identity(&read(certificate)?, &read(key)?)?;
        }
        Ok(credentials)
    }

    /// The secret of the key, if one is given.
    pub fn secret(&self) -> Result<Option<String>, CliError> {
        match (&self.key, &self.key_file) {
            (Some(Hidden(secret)), _) => Ok(Some(secret.clone())),
            (None, Some(file)) => Ok(Some(String::from_utf8_lossy(&read(file)?).trim().to_owned())),
            (None, None) => Ok(None),
        }
    }
}

impl From<String> for Hidden {
    fn from(secret: String) -> Self {
        Self(secret)
    }
}

impl std::fmt::Debug for Hidden {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Hidden(..)")
    }
}

pub(crate) fn read(file: &Path) -> Result<Vec<u8>, CliError> {
    fs::read(file).map_err(|error| CliError::failed(format!("{}: {error}", file.display())))
}

#[derive(Debug, clap::Args)]
pub(super) struct MapOptions {
    /// The map's name on the server
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    pub(super) name: MapName,
    #[command(flatten)]
    pub(super) server: ServerOptions,
}
