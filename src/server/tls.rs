//! TLS: certificates from files that are read again when they change.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls;
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::pem;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::server::danger::ClientCertVerifier;
use tokio_rustls::rustls::server::{VerifierBuilderError, WebPkiClientVerifier};
use tokio_rustls::rustls::{RootCertStore, ServerConfig};
use x509_parser::parse_x509_certificate;

use super::handshakes::FailedHandshakes;
use super::protocol::Protocol;
use crate::access::{ReloadableFile, is_open_to_others};
use crate::config::TlsConfig;

/// Why connections cannot be secured.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file that cannot be read, or is no PEM.
    #[error("{setting}: {}: {problem}", path.display())]
    File {
        /// Which of the settings.
        setting: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The certificate and the key do not go together, or the certificate is none.
    #[error("tls.certificate and tls.key: {0}")]
    Certificate(rustls::Error),
    /// The authority of clients' certificates is none.
    #[error("tls.client_ca: {0}")]
    ClientCa(#[from] VerifierBuilderError),
}

/// What TCP connections are secured with. A clone is another handle on the same certificates.
#[derive(Debug, Clone)]
pub(super) struct Tls {
    files: Arc<ReloadableFile<Certificates, TlsError>>,
    failures: Arc<FailedHandshakes>,
}

/// As they were when the files were last read; connections that were made with former ones go on.
pub(super) struct Certificates {
    http: TlsAcceptor,
    grpc: TlsAcceptor,
    expiries: Vec<Expiry>,
}

/// When the first certificate of a file expires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Expiry {
    /// Which of the settings names the file.
    pub(super) setting: &'static str,
    /// Seconds since 1970 in UTC.
    pub(super) timestamp_s: i64,
}

impl Tls {
    /// The certificates that the settings name, if any.
    ///
    /// # Errors
    /// When they cannot be used.
    pub(super) fn of(settings: &TlsConfig) -> Result<Option<Self>, TlsError> {
        let (Some(certificate), Some(key)) = (&settings.certificate, &settings.key) else {
            return Ok(None);
        };
        let files = [Some(certificate), Some(key), settings.client_ca.as_ref()];
        let files = files.into_iter().flatten().cloned().collect();
        let (certificate, key, client_ca) = (certificate.clone(), key.clone(), settings.client_ca.clone());
        let read =
            move |_: Option<&Certificates>| Certificates::read(&certificate, &key, client_ca.as_deref());
        Ok(Some(Self { files: Arc::new(ReloadableFile::new(files, read)?), failures: Arc::default() }))
    }

    /// The files, to be read again.
    pub(super) fn files(&self) -> &ReloadableFile<Certificates, TlsError> {
        &self.files
    }

    /// The handshakes that failed.
    pub(super) fn failures(&self) -> &FailedHandshakes {
        &self.failures
    }

    /// When the certificates in force expire.
    pub(super) fn expiries(&self) -> Vec<Expiry> {
        self.files.current().expiries.clone()
    }

    /// What a new connection is secured with.
    pub(super) fn acceptor(&self, protocol: Protocol) -> TlsAcceptor {
        let certificates = self.files.current();
        match protocol {
            Protocol::Http | Protocol::Admin => certificates.http.clone(),
            Protocol::Grpc => certificates.grpc.clone(),
        }
    }
}

impl Certificates {
    fn read(certificate: &Path, key: &Path, client_ca: Option<&Path>) -> Result<Self, TlsError> {
        if is_open_to_others(key) {
            tracing::warn!(path = %key.display(), "everybody on this machine may read or write the private key");
        }
        let provider = Arc::new(ring::default_provider());
        let chain = certificates_of("tls.certificate", certificate)?;
        let mut expiries = vec![Expiry::of("tls.certificate", &chain)];
        let key = PrivateKeyDer::from_pem_file(key).map_err(in_file("tls.key", key))?;
        let verifier = client_ca.map(|path| verifier(path, &provider, &mut expiries)).transpose()?;
        let config = ServerConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .map_err(TlsError::Certificate)?;
        let config = match verifier {
            Some(verifier) => config.with_client_cert_verifier(verifier),
            None => config.with_no_client_auth(),
        };
        let config = config.with_single_cert(chain, key).map_err(TlsError::Certificate)?;
        let speaking = |protocols: &[&str]| {
            let mut config = config.clone();
            config.alpn_protocols = protocols.iter().map(|protocol| protocol.as_bytes().to_vec()).collect();
            TlsAcceptor::from(Arc::new(config))
        };
        let expiries = expiries.into_iter().flatten().collect();
        Ok(Self { http: speaking(&["h2", "http/1.1"]), grpc: speaking(&["h2"]), expiries })
    }
}

impl Expiry {
    /// The expiry of the certificate which expires first; none where none can be read, which rustls says in its own
    /// words.
    fn of(setting: &'static str, certificates: &[CertificateDer<'_>]) -> Option<Self> {
        let not_after = |certificate: &CertificateDer<'_>| {
            let (_, certificate) = parse_x509_certificate(certificate).ok()?;
            Some(certificate.validity().not_after.timestamp())
        };
        let timestamp_s = certificates.iter().filter_map(not_after).min()?;
        Some(Self { setting, timestamp_s })
    }

    /// Seconds from `now` until then; less than none where it has expired.
    pub(super) fn in_s(self, now: SystemTime) -> i64 {
        let since_1970 = now.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        self.timestamp_s.saturating_sub(since_1970.as_secs().try_into().unwrap_or(i64::MAX))
    }
}

/// Refuses clients without a certificate that one of the file's has signed.
fn verifier(
    path: &Path,
    provider: &Arc<CryptoProvider>,
    expiries: &mut Vec<Option<Expiry>>,
) -> Result<Arc<dyn ClientCertVerifier>, TlsError> {
    let mut roots = RootCertStore::empty();
    let certificates = certificates_of("tls.client_ca", path)?;
    expiries.push(Expiry::of("tls.client_ca", &certificates));
    for certificate in certificates {
        roots.add(certificate).map_err(|error| problem("tls.client_ca", path, error))?;
    }
    Ok(WebPkiClientVerifier::builder_with_provider(Arc::new(roots), Arc::clone(provider)).build()?)
}

fn certificates_of(setting: &'static str, path: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let certificates = CertificateDer::pem_file_iter(path).map_err(in_file(setting, path))?;
    let certificates: Vec<_> = certificates.collect::<Result<_, _>>().map_err(in_file(setting, path))?;
    if certificates.is_empty() {
        return Err(problem(setting, path, "there is no certificate in it"));
    }
    Ok(certificates)
}

/// What is wrong with a file, without anything that it holds.
fn in_file(setting: &'static str, path: &Path) -> impl Fn(pem::Error) -> TlsError {
    move |error| match error {
        pem::Error::Io(error) => problem(setting, path, error),
        pem::Error::NoItemsFound => problem(setting, path, "there is none in it"),
        _ => problem(setting, path, "it must be PEM"),
    }
}

fn problem(setting: &'static str, path: &Path, problem: impl ToString) -> TlsError {
    TlsError::File { setting, path: path.to_owned(), problem: problem.to_string() }
}
