//! Certificates.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// How TCP connections of both protocols are secured; in the clear without a certificate. Unix sockets never are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TlsConfig {
    /// The server's certificate, PEM, its signers after it.
    pub certificate: Option<PathBuf>,
    /// The certificate's private key, PEM.
    pub key: Option<PathBuf>,
    /// Certificates, PEM, of who may sign those of clients: without one of theirs nobody may connect.
    pub client_ca: Option<PathBuf>,
    /// Days before a certificate expires from which on the log says so, once a day; 0 to 3650. 14.
    pub expiry_warning_days: u32,
}

impl Default for TlsConfig {
    fn default() -> Self {
        Self { certificate: None, key: None, client_ca: None, expiry_warning_days: 14 }
    }
}

impl TlsConfig {
    /// How long before a certificate expires it is warned of.
    pub fn expiry_warning(&self) -> Duration {
        super::access::days(self.expiry_warning_days)
    }

    /// What lacks, as a setting, and the setting that needs it.
    pub(super) fn missing(&self) -> Option<(&'static str, &'static str)> {
        match (&self.certificate, &self.key, &self.client_ca) {
            (None, Some(_), _) => Some(("tls.certificate", "tls.key")),
            (Some(_), None, _) => Some(("tls.key", "tls.certificate")),
            (None, None, Some(_)) => Some(("tls.certificate", "tls.client_ca")),
            _ => None,
        }
    }
}
