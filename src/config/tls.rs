//! Section `tls` of the settings.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Settings of TLS for the TCP connections of both protocols. Without a certificate they are not encrypted. Unix
/// sockets never are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TlsConfig {
    /// Path of the server's certificate, PEM, followed by its signers.
    pub certificate: Option<PathBuf>,
    /// Path of the certificate's private key, PEM.
    pub key: Option<PathBuf>,
    /// Path of the certificates, PEM, that sign those of clients. Where it is given, a client needs such a certificate
    /// to connect.
    pub client_ca: Option<PathBuf>,
    /// Number of days before a certificate expires from which on the log warns of it once a day; 0 to 3650. 14.
    pub expiry_warning_days: u32,
}

impl Default for TlsConfig {
    fn default() -> Self {
        Self { certificate: None, key: None, client_ca: None, expiry_warning_days: 14 }
    }
}

impl TlsConfig {
    /// Time before a certificate expires from which on it is warned of.
    pub fn expiry_warning(&self) -> Duration {
        super::access::days(self.expiry_warning_days)
    }

    /// A missing setting and the setting that needs it, if there is one.
    pub(super) fn missing(&self) -> Option<(&'static str, &'static str)> {
        match (&self.certificate, &self.key, &self.client_ca) {
            (None, Some(_), _) => Some(("tls.certificate", "tls.key")),
            (Some(_), None, _) => Some(("tls.key", "tls.certificate")),
            (None, None, Some(_)) => Some(("tls.certificate", "tls.client_ca")),
            _ => None,
        }
    }
}
