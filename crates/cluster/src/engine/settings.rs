//! What a connection is made of.

use std::path::PathBuf;

/// How a node reaches NATS, and how often NATS keeps what it is given.
#[derive(Debug, Clone)]
pub struct EngineSettings {
    /// Addresses of the NATS servers: `nats://HOST:PORT`, or `tls://` for TLS; `nats://USER:PASSWORD@HOST:PORT` where
    /// the servers ask for a password. One that answers is enough: it names the others.
    pub urls: Vec<String>,
    /// What the servers ask for besides a password in the address.
    pub credentials: Credentials,
    /// File of certificates in PEM that are trusted, besides those of the system.
    pub root_certificates: Option<PathBuf>,
    /// On how many servers each stream is kept: 3 survives the loss of one, 1 none.
    pub replicas: usize,
    /// What the servers list this connection as.
    pub name: String,
}

/// What NATS servers ask for besides a password in the address.
#[derive(Debug, Clone, Default)]
pub enum Credentials {
    /// Nothing.
    #[default]
    None,
    /// A `.creds` file: a user's token and its key.
    CredentialsFile(PathBuf),
    /// A file that holds the seed of an nkey, `SU...`.
    NkeySeedFile(PathBuf),
}

impl EngineSettings {
    /// The addresses without user and password, for messages.
    pub(super) fn servers(&self) -> String {
        let shown: Vec<_> = self.urls.iter().map(|url| without_password(url)).collect();
        shown.join(", ")
    }

    /// User and password of the first address that has them, as they stand there: NATS takes them for all servers.
    pub(super) fn user_and_password(&self) -> Option<(&str, &str)> {
        self.urls.iter().find_map(|url| {
            let (before_host, _) = url.rsplit_once('@')?;
            let user_and_password = before_host.split_once("://").map_or(before_host, |(_, rest)| rest);
            user_and_password.split_once(':')
        })
    }
}

/// An address without user and password.
fn without_password(url: &str) -> String {
    match (url.split_once("://"), url.rsplit_once('@')) {
        (Some((scheme, _)), Some((_, host))) => format!("{scheme}://{host}"),
        (None, Some((_, host))) => host.to_owned(),
        (_, None) => url.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passwords_are_not_shown() {
        assert_eq!(without_password("nats://u:p@a:4222"), "nats://a:4222");
        assert_eq!(without_password("u:p@a:4222"), "a:4222");
        assert_eq!(without_password("tls://a:4222"), "tls://a:4222");
    }

    #[test]
    fn user_and_password_may_stand_in_any_of_the_addresses() {
        let of = |urls: &[&str]| EngineSettings {
            urls: urls.iter().map(|&url| url.to_owned()).collect(),
            credentials: Credentials::None,
            root_certificates: None,
            replicas: 3,
            name: "test".to_owned(),
        };
        assert_eq!(of(&["nats://a:4222", "nats://u:p:q@b:4222"]).user_and_password(), Some(("u", "p:q")));
        assert_eq!(of(&["u:p@a"]).user_and_password(), Some(("u", "p")));
        assert_eq!(of(&["nats://a:4222"]).user_and_password(), None);
    }
}
