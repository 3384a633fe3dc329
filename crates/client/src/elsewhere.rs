//! Servers that others name, since they hold a map which those do not.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::addresses::addresses;
use super::connection::{Address, Connection};
use super::credentials::Credentials;
use super::error::ClientError;
use mrol_map::map::MapName;

/// How often one call is sent on.
pub(super) const HOPS_MAX: usize = 2;

/// How long a server that was named may take to answer a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// The schemes whose servers send calls on: to addresses of the same scheme alone.
const SCHEMES: [&str; 2] = ["https://", "http://"];

/// Servers that others named, and which of them holds which map.
///
/// A call goes there with the key, so it goes to addresses of the scheme alone that the client's own have: what was to
/// be sent by TLS is not sent in the clear.
#[derive(Debug)]
pub(super) struct Elsewhere {
    credentials: Credentials,
    scheme: &'static str,
    known: Mutex<Known>,
}

#[derive(Debug, Default)]
struct Known {
    /// Addresses of the servers that hold maps, by the maps' names.
    by_map: HashMap<String, Arc<str>>,
    /// The connections to them, by their addresses.
    connections: HashMap<Arc<str>, Connection>,
}

impl Elsewhere {
    /// For a client of the addresses in a text; none where they are sockets, or have several schemes.
    pub(super) fn of(text: &str, credentials: &Credentials) -> Option<Self> {
        let scheme_of = |url: &&str| {
            let full = Address::parse(url, credentials).ok()?.url;
            SCHEMES.into_iter().find(|scheme| full.starts_with(scheme))
        };
        let urls = addresses(text);
        let scheme = urls.first().and_then(scheme_of)?;
        let is_one = urls.iter().all(|url| scheme_of(url) == Some(scheme));
        is_one.then(|| Self { credentials: credentials.clone(), scheme, known: Mutex::default() })
    }

    /// The addresses that a refusal names and to which a call may be sent on.
    pub(super) fn named<'e>(&self, error: &'e ClientError) -> impl Iterator<Item = &'e str> + use<'e> {
        let scheme = self.scheme;
        let named = match error {
            ClientError::Refused { elsewhere, .. } => elsewhere.as_slice(),
            _ => &[],
        };
        // No server has a user and a password in its address.
        named
            .iter()
            .map(String::as_str)
            .filter(move |address| address.starts_with(scheme) && !address.contains('@'))
    }

    /// True once a map was found elsewhere.
    pub(super) fn is_used(&self) -> bool {
        !self.known.lock().connections.is_empty()
    }

    /// Where a map is, as far as is known.
    pub(super) fn place(&self, map: &MapName) -> Option<Arc<str>> {
        self.known.lock().by_map.get(map.as_str()).cloned()
    }

    /// Notes where a map is.
    pub(super) fn note(&self, map: &MapName, address: &str) {
        self.known.lock().by_map.insert(map.to_string(), address.into());
    }

    /// Forgets where a map is.
    pub(super) fn forget(&self, map: &MapName) {
        self.known.lock().by_map.remove(map.as_str());
    }

    /// The connection to a server that was named, made by `until` where there is none.
    ///
    /// # Errors
    /// When no server answers there, or the two do not trust each other.
    pub(super) async fn connection(
        &self,
        address: &str,
        until: Option<Instant>,
    ) -> Result<Connection, ClientError> {
        let kept = self.known.lock().connections.get(address).cloned();
        if let Some(kept) = kept.filter(|kept| !kept.is_gone()) {
            return Ok(kept);
        }
        let left = until.map(|until| until.saturating_duration_since(Instant::now()));
        let timeout = left.map_or(CONNECT_TIMEOUT, |left| left.min(CONNECT_TIMEOUT));
        let parsed = Address::parse(address, &self.credentials)?.with_keepalive();
        let made = parsed.connect(&self.credentials, timeout).await?.replaceable();
        self.known.lock().connections.insert(address.into(), made.clone());
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn named(own: &str) -> Option<Vec<String>> {
        let elsewhere =
            ["http://b:1", "https://b:1", "b:1", "unix:/b", "ftp://b", "http://c:1", "https://c:1"];
        let elsewhere = elsewhere.map(str::to_owned).into();
        let (reason, message) = (Some("map_elsewhere".to_owned()), String::new());
        let refused =
            ClientError::Refused { code: Code::Unavailable, reason, message, retry_after: None, elsewhere };
        let servers = Elsewhere::of(own, &Credentials::default())?;
        Some(servers.named(&refused).map(str::to_owned).collect())
    }

    #[test]
    fn a_call_is_sent_on_by_the_scheme_of_the_clients_own_addresses_alone() {
        let in_the_clear = ["http://b:1", "http://c:1"].map(str::to_owned);
        assert_eq!(named("http://a:1").unwrap(), in_the_clear);
        assert_eq!(named("a:1,http://d:1").unwrap(), in_the_clear);
        assert_eq!(named("https://a:1").unwrap(), ["https://b:1", "https://c:1"]);
        assert_eq!(named("http://a:1,https://b:1"), None);
        assert_eq!(named("unix:/a"), None);
    }
}
