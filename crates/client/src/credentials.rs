//! Credentials of a client: its key, its certificate, and the certificates that it trusts.

use std::fmt;
use std::sync::Arc;

use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::transport::{Certificate, ClientTlsConfig, Identity};
use tonic::{Request, Status};

use super::error::ClientError;
use crate::wire::{CALLER, NODE};
use mrol_map::map::CallerName;
use mrol_service::replication::NodeName;

/// Credentials of a client: the key and certificate that it shows, and the certificate authorities that it trusts. By
/// default it shows nothing and trusts those of the system.
#[derive(Clone, Default)]
pub struct Credentials {
    shown: Shown,
    server_ca: Option<Certificate>,
    identity: Option<Identity>,
}

/// What is sent with every call.
#[derive(Clone, Default)]
pub(super) struct Shown {
    key: Option<MetadataValue<Ascii>>,
    /// Of calls that a node forwards.
    forwarded: Option<Arc<Forwarded>>,
}

/// What a node says of a call that it forwards.
#[derive(Debug)]
struct Forwarded {
    /// The node.
    node: Option<MetadataValue<Ascii>>,
    /// Its caller.
    caller: Option<MetadataValue<Ascii>>,
}

impl Credentials {
    /// Sends the secret of a key with every call.
    ///
    /// # Errors
    /// When the secret has characters that no secret has. The error does not repeat the secret.
    pub fn with_key(self, secret: &str) -> Result<Self, ClientError> {
        let problem = "the key must be the secret that `mrol key new` prints, in one line";
        let secret = secret.trim();
        let value = format!("Bearer {secret}").parse::<MetadataValue<Ascii>>();
        let Some(mut key) =
            value.ok().filter(|_| !secret.is_empty() && !secret.contains(char::is_whitespace))
        else {
            return Err(ClientError::Credentials(problem.into()));
        };
        key.set_sensitive(true);
        Ok(Self { shown: Shown { key: Some(key), ..self.shown }, ..self })
    }

    /// Trusts only servers whose certificate is signed by one of these (PEM).
    ///
    /// # Errors
    /// When `pem` holds no certificate.
    pub fn with_server_ca(self, pem: &[u8]) -> Result<Self, ClientError> {
        has_block(pem, "CERTIFICATE", "the server's authority")?;
        Ok(Self { server_ca: Some(Certificate::from_pem(pem)), ..self })
    }

    /// Shows a client certificate (PEM, followed by its signers) with its private key, as mutual TLS needs.
    ///
    /// # Errors
    /// When there is no certificate or no key.
    pub fn with_identity(self, certificate: &[u8], key: &[u8]) -> Result<Self, ClientError> {
        has_block(certificate, "CERTIFICATE", "the client's certificate")?;
        has_block(key, "PRIVATE KEY", "the client's private key")?;
        Ok(Self { identity: Some(Identity::from_pem(certificate, key)), ..self })
    }

    pub(super) fn shown(&self) -> Shown {
        self.shown.clone()
    }

    /// True when the credentials are of use only with TLS.
    pub(super) fn want_tls(&self) -> bool {
        self.server_ca.is_some() || self.identity.is_some()
    }

    pub(super) fn tls(&self) -> ClientTlsConfig {
        let trusting = match &self.server_ca {
            Some(ca) => ClientTlsConfig::new().ca_certificate(ca.clone()),
            None => ClientTlsConfig::new().with_native_roots(),
        };
        match &self.identity {
            Some(identity) => trusting.identity(identity.clone()),
            None => trusting,
        }
    }
}

impl Shown {
    /// The same, of calls that the node `node` forwards for a caller of its own: the holder of a key, or anybody.
    pub(super) fn forwarded(self, node: &NodeName, caller: Option<&CallerName>) -> Self {
        // Their letters are those of a header.
        let value = |name: &str| MetadataValue::try_from(name).ok();
        let caller = caller.and_then(|caller| value(caller.as_str()));
        Self { forwarded: Some(Arc::new(Forwarded { node: value(node.as_str()), caller })), ..self }
    }
}

impl Interceptor for Shown {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        let mut show = |name, value: &Option<MetadataValue<Ascii>>| {
            if let Some(value) = value {
                request.metadata_mut().insert(name, value.clone());
            }
        };
        show("authorization", &self.key);
        if let Some(Forwarded { node, caller }) = self.forwarded.as_deref() {
            show(NODE, node);
            show(CALLER, caller);
        }
        Ok(request)
    }
}

impl fmt::Debug for Shown {
    /// Says whether there is a key, without its value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, forwarded } = self;
        f.debug_struct("Shown").field("key", &key.is_some()).field("forwarded", forwarded).finish()
    }
}

impl fmt::Debug for Credentials {
    /// Says which credentials are set, without their values.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Credentials")
            .field("key", &self.shown.key.is_some())
            .field("server_ca", &self.server_ca.is_some())
            .field("identity", &self.identity.is_some())
            .finish()
    }
}

/// Checks that `pem` has a block of the kind `block`. Without one it would count as an empty store, and the error would
/// come much later.
fn has_block(pem: &[u8], block: &str, what: &str) -> Result<(), ClientError> {
    let text = String::from_utf8_lossy(pem);
    let begins = text.lines().any(|line| line.starts_with("-----BEGIN ") && line.contains(block));
    let missing = || ClientError::Credentials(format!("{what} must be PEM with a {block} in it"));
    begins.then_some(()).ok_or_else(missing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_shown_to_the_server_and_to_nobody_else() {
        let credentials = Credentials::default().with_key(" mrol_1\n").unwrap();
        assert!(!format!("{credentials:?} {:?}", credentials.shown()).contains("mrol_1"));
        let request = credentials.shown().call(Request::new(())).unwrap();
        assert_eq!(request.metadata().get("authorization").unwrap(), "Bearer mrol_1");
        assert!(!format!("{request:?}").contains("mrol_1"));
    }

    #[test]
    fn a_node_names_itself_and_its_caller_and_nobody_else_does() {
        let credentials = Credentials::default().with_key("mrol_1").unwrap();
        let sent = |mut shown: Shown| {
            let request = shown.call(Request::new(())).unwrap();
            [NODE, CALLER].map(|name| request.metadata().get(name).map(|it| it.to_str().unwrap().to_owned()))
        };
        assert_eq!(sent(credentials.shown()), [None, None]);
        let (node, caller) = (NodeName::new("node-1").unwrap(), CallerName::new("R_1.b").unwrap());
        let [of_caller, of_anybody] =
            [Some(&caller), None].map(|caller| sent(credentials.shown().forwarded(&node, caller)));
        assert_eq!(of_caller, [Some("node-1".to_owned()), Some("R_1.b".to_owned())]);
        assert_eq!(of_anybody, [Some("node-1".to_owned()), None]);
    }

    #[test]
    fn what_is_no_secret_is_not_repeated() {
        for bad in ["", " ", "mrol_1\nmrol_2", "mrol 1", "mrol_1\u{7f}"] {
            let error = Credentials::default().with_key(bad).unwrap_err().to_string();
            assert!(error.contains("mrol key new") && !error.contains("mrol_1"), "{error}");
        }
    }

    #[test]
    fn what_is_no_pem_is_told_at_once() {
        let pem = b"-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n";
        assert!(Credentials::default().with_server_ca(pem).is_ok());
        assert!(Credentials::default().with_server_ca(b"DER").is_err());
        let error = Credentials::default().with_identity(pem, pem).unwrap_err().to_string();
        assert!(error.contains("private key must be PEM"), "{error}");
    }
}
