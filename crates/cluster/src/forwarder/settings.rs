//! What a forwarder is made of.

use std::path::{Path, PathBuf};
use std::time::Duration;

use mrol_client::{ClientError, Credentials};
use mrol_service::replication::NodeName;

/// How a node asks the others.
#[derive(Clone)]
pub struct ForwarderSettings {
    /// This node.
    pub node: NodeName,
    /// The secret of the cluster, by which nodes believe each other whom they ask for; none where no keys are asked
    /// for.
    pub secret: Option<String>,
    /// File of certificates in PEM that are trusted in the place of those of the system.
    pub root_certificates: Option<PathBuf>,
    /// What this node shows to nodes that ask for a client certificate.
    pub certificate: Option<NodeCertificate>,
    /// How long connecting to another node may take.
    pub connect_timeout: Duration,
    /// How long a call may take: longer than the longest of the limits on changes, `limits.undo_time_max_s`, or callers
    /// hear `outcome_unknown` of changes that the other node would still have made.
    pub call_timeout: Duration,
    /// How long a call may wait until fewer others are on their way to the same node: it is refused then, and was not
    /// sent.
    pub place_timeout: Duration,
}

/// Files of a certificate in PEM, followed by its signers, and of its private key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeCertificate {
    /// The certificate.
    pub certificate: PathBuf,
    /// The key.
    pub key: PathBuf,
}

/// Why settings are of no use.
#[derive(Debug, thiserror::Error)]
pub enum ForwarderError {
    /// A file cannot be read.
    #[error("cannot read {file}: {cause}", file = .file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// What is to be shown or trusted is none of that.
    #[error(transparent)]
    Credentials(#[from] ClientError),
}

impl ForwarderSettings {
    /// Longer than any change takes as the limits are set by default.
    pub const CALL_TIMEOUT: Duration = Duration::from_secs(120);
    /// Whoever waits for a node that is gone is to hear of it soon.
    pub const CONNECT_TIMEOUT: Duration = Duration::from_secs(1);

    /// Others end meanwhile, as a rule.
    pub const PLACE_TIMEOUT: Duration = Duration::from_secs(5);

    /// How `node` asks nodes that ask for no keys, and whose certificates the system trusts.
    pub fn new(node: NodeName) -> Self {
        Self {
            node,
            secret: None,
            root_certificates: None,
            certificate: None,
            connect_timeout: Self::CONNECT_TIMEOUT,
            call_timeout: Self::CALL_TIMEOUT,
            place_timeout: Self::PLACE_TIMEOUT,
        }
    }

    /// What is shown to other nodes, and which of them are trusted. Reads files.
    pub(super) fn credentials(&self) -> Result<Credentials, ForwarderError> {
        let mut credentials = Credentials::default();
        if let Some(secret) = &self.secret {
            credentials = credentials.with_key(secret)?;
        }
        if let Some(file) = &self.root_certificates {
            credentials = credentials.with_server_ca(&read(file)?)?;
        }
        if let Some(NodeCertificate { certificate, key }) = &self.certificate {
            credentials = credentials.with_identity(&read(certificate)?, &read(key)?)?;
        }
        Ok(credentials)
    }
}

impl std::fmt::Debug for ForwarderSettings {
    /// Without the secret.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ForwarderSettings")
            .field("node", &self.node)
            .field("secret", &self.secret.is_some())
            .field("root_certificates", &self.root_certificates)
            .field("certificate", &self.certificate)
            .field("connect_timeout", &self.connect_timeout)
            .field("call_timeout", &self.call_timeout)
            .field("place_timeout", &self.place_timeout)
            .finish()
    }
}

fn read(file: &Path) -> Result<Vec<u8>, ForwarderError> {
    std::fs::read(file).map_err(|cause| ForwarderError::File { file: file.to_owned(), cause })
}
