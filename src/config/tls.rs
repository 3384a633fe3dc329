//! Section `tls` of the settings.

use std::path::PathBuf;
use std::time::Duration;

use mrol_service::section;

use super::access::WARNING_DAYS_MAX;

section! {
    /// Settings of TLS for the TCP connections of both protocols. Without a certificate they are not encrypted. Unix
    /// sockets never are.
    pub struct TlsConfig in "tls" {
        /// Path of the server's certificate, PEM, followed by its signers.
        certificate: Option<PathBuf> = None; none;
        /// Path of the certificate's private key, PEM.
        key: Option<PathBuf> = None; none;
        /// Path of the certificates, PEM, that sign those of clients. Where it is given, a client needs such a
        /// certificate to connect.
        client_ca: Option<PathBuf> = None; none;
        /// How long before a certificate expires the log warns of it, once a day.
        expiry_warning_days: u32 = 14; days, from 0, to WARNING_DAYS_MAX;
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
