//! An authority that signs certificates, and servers and clients that hold them.

use std::fs;
use std::path::{Path, PathBuf};

use mrol::client::{Client, ClientError, Credentials};
use mrol::config::TlsConfig;
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair};
use tempfile::TempDir;
use time::OffsetDateTime;

use crate::support::daemon::Daemon;

/// What is known of nobody else.
pub(crate) struct Authority(CertifiedIssuer<'static, KeyPair>);

/// A certificate and its key, PEM.
pub(crate) struct Signed {
    pub(crate) certificate: String,
    pub(crate) key: String,
}

impl Authority {
    pub(crate) fn new() -> Self {
        let mut params = CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        Self(CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap())
    }

    pub(crate) fn pem(&self) -> String {
        self.0.pem()
    }

    /// A certificate of a server at localhost, or of a client.
    pub(crate) fn sign(&self) -> Signed {
        let key = KeyPair::generate().unwrap();
        self.signed(&key, CertificateParams::new(vec!["localhost".into(), "127.0.0.1".into()]).unwrap())
    }

    /// The same, which counts until `end`.
    pub(crate) fn sign_until(&self, end: OffsetDateTime) -> Signed {
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::new(vec!["localhost".into(), "127.0.0.1".into()]).unwrap();
        params.not_after = end;
        self.signed(&key, params)
    }

    fn signed(&self, key: &KeyPair, params: CertificateParams) -> Signed {
        Signed { certificate: params.signed_by(key, &self.0).unwrap().pem(), key: key.serialize_pem() }
    }

    /// What a client shows who trusts this authority.
    pub(crate) fn trusted(&self) -> Credentials {
        Credentials::default().with_server_ca(self.pem().as_bytes()).unwrap()
    }
}

/// The files that a server's settings name.
pub(crate) struct Files(TempDir);

impl Files {
    pub(crate) fn of(signed: &Signed) -> Self {
        let files = Self(tempfile::tempdir().unwrap());
        files.replace(signed);
        files
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// First the one, then the other, as an administrator does: in between they do not go together.
    pub(crate) fn replace(&self, signed: &Signed) {
        fs::write(self.path("certificate.pem"), &signed.certificate).unwrap();
        fs::write(self.path("key.pem"), &signed.key).unwrap();
    }

    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    pub(crate) fn settings(&self, client_ca: Option<&Path>) -> TlsConfig {
        TlsConfig {
            certificate: Some(self.path("certificate.pem")),
            key: Some(self.path("key.pem")),
            client_ca: client_ca.map(Path::to_owned),
            ..TlsConfig::default()
        }
    }

    /// A server with these.
    pub(crate) async fn serve(&self, client_ca: Option<&Path>) -> Daemon {
        let tls = self.settings(client_ca);
        Daemon::start_with(|config| {
            config.data_dir = "".into();
            config.tls = tls;
        })
        .await
    }
}

/// Connects and asks something: a handshake may be refused as late as that.
pub(crate) async fn ask(daemon: &Daemon, credentials: &Credentials) -> Result<Client, ClientError> {
    let client =
        Client::connect_with(&format!("https://localhost:{}", daemon.grpc.port()), credentials).await?;
    client.list_maps().await.map(|_| client)
}
