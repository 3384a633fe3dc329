//! Options of the credentials of commands that call a server.

use std::fs;
use std::path::{Path, PathBuf};

use mrol_client::Credentials;

use super::error::CliError;

/// Heading of these options in a command's help.
const HEADING: &str = "Access";

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

fn read(file: &Path) -> Result<Vec<u8>, CliError> {
    fs::read(file).map_err(|error| CliError::failed(format!("{}: {error}", file.display())))
}
