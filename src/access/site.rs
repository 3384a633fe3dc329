//! Requests that a browser sends on behalf of a page of somebody else.
//!
//! A page may send requests wherever its visitor's browser reaches, this machine's loopback among it. Two rules keep
//! such requests out. A page whose own name was made to lead here (DNS rebinding) shows by `Host`, so a server that
//! asks for no key answers to names that it knows alone. A page of another site shows by `Origin` and `Sec-Fetch-Site`,
//! and changes nothing.

use std::collections::BTreeSet;
use std::net::IpAddr;
use std::sync::Arc;

use axum::http::header::{HOST, ORIGIN};
use axum::http::uri::Authority;
use axum::http::{Extensions, HeaderMap, Request, Uri};

use mrol_map::util::excerpt;
use mrol_service::{Reason, ServiceError};

/// Where a request came in; to be found among its extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReachedAt {
    /// The address that its client connected to.
    Address(IpAddr),
    /// A socket of this machine, which no browser reaches.
    UnixSocket,
}

/// The names that a server without keys answers to, besides loopback's and the address that was connected to.
#[derive(Debug, Clone, Default)]
pub(super) struct Hosts(Arc<BTreeSet<String>>);

impl Hosts {
    /// The names of `access.hosts`.
    pub(super) fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        Self(Arc::new(names.into_iter().map(normalized).collect()))
    }

    /// Asks whether a request names this server.
    ///
    /// # Errors
    /// `PermissionDenied` with `host_not_allowed` where it names another, or none.
    pub(super) fn check<B>(&self, request: &Request<B>) -> Result<(), ServiceError> {
        let at = match reached_at(request.extensions()) {
            Some(ReachedAt::UnixSocket) => return Ok(()),
            Some(ReachedAt::Address(address)) => Some(address.to_canonical()),
            None => None,
        };
        let mut named = named(request.uri(), request.headers()).peekable();
        if named.peek().is_none() {
            return Err(not_allowed("no host"));
        }
        named.try_for_each(|host| match host {
            Some(host) if self.answers_to(host.host(), at) => Ok(()),
            Some(host) => Err(not_allowed(&format!("host {}", excerpt(host.host())))),
            None => Err(not_allowed("a host that is none")),
        })
    }

    fn answers_to(&self, host: &str, at: Option<IpAddr>) -> bool {
        let host = normalized(host);
        let listed = host == "localhost" || self.0.contains(&host);
        let address = host.parse::<IpAddr>().ok().map(|address| address.to_canonical());
        listed || address.is_some_and(|address| address.is_loopback() || Some(address) == at)
    }
}

/// Whether an entry of `access.hosts` is a name or an address, without a port.
pub fn is_host(text: &str) -> bool {
    let name = |text: &str| {
        (1..=253).contains(&text.len())
            && text.bytes().all(|c| c.is_ascii_alphanumeric() || b"-._".contains(&c))
    };
    name(text) || text.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().is_ok()
}

/// Asks whether a request that changes something may be a page's of another site.
///
/// # Errors
/// `PermissionDenied` with `cross_site` where its browser says so.
pub(super) fn check_origin<B>(request: &Request<B>) -> Result<(), ServiceError> {
    let headers = request.headers();
    if headers.get("sec-fetch-site").is_some_and(|site| site == "cross-site") {
        return Err(cross_site("sec-fetch-site is cross-site"));
    }
    let hosts: Vec<_> = named(request.uri(), headers).flatten().collect();
    for origin in headers.get_all(ORIGIN) {
        let origin = origin.to_str().unwrap_or("null");
        if !hosts.iter().any(|host| is_at(origin, host)) {
            return Err(cross_site(&format!("origin is {}", excerpt(origin))));
        }
    }
    Ok(())
}

/// Every host that a request names: HTTP/2's `:authority`, and `Host`. None where one cannot be read.
fn named<'a>(uri: &'a Uri, headers: &'a HeaderMap) -> impl Iterator<Item = Option<Authority>> + 'a {
    let authority = uri.authority().cloned().map(Some);
    let header = headers.get_all(HOST).iter().map(|host| host.to_str().ok()?.parse().ok());
    authority.into_iter().chain(header)
}

/// True where a page of `origin` came from `host`, in the clear or not.
fn is_at(origin: &str, host: &Authority) -> bool {
    let Ok(origin) = origin.parse::<Uri>() else { return false };
    let default = match origin.scheme_str() {
        Some("http") => 80,
        Some("https") => 443,
        _ => return false,
    };
    let port = |port: Option<u16>| port.unwrap_or(default);
    let same_name = origin.host().is_some_and(|name| normalized(name) == normalized(host.host()));
    same_name && port(origin.port_u16()) == port(host.port_u16())
}

/// As names are compared: in lower case, without the dot that may end them and the brackets around addresses.
fn normalized(host: &str) -> String {
    let host = host.strip_suffix('.').unwrap_or(host);
    let host = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
    host.to_ascii_lowercase()
}

fn reached_at(extensions: &Extensions) -> Option<ReachedAt> {
    extensions.get().copied()
}

fn not_allowed(what: &str) -> ServiceError {
    let message = format!(
        "{what} is none of this server's, which asks for no key: it answers to localhost, loopback addresses, the \
         address connected to and what access.hosts lists"
    );
    ServiceError::new(Reason::HostNotAllowed, message)
}

fn cross_site(what: &str) -> ServiceError {
    let message = format!("{what}: pages of other sites change nothing here");
    ServiceError::new(Reason::CrossSite, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(uri: &str, headers: &[(&'static str, &'static str)], at: Option<ReachedAt>) -> Request<()> {
        let mut request = Request::builder().uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let mut request = request.body(()).unwrap();
        if let Some(at) = at {
            request.extensions_mut().insert(at);
        }
        request
    }

    #[test]
    fn a_server_answers_to_its_own_names_alone() {
        let hosts = Hosts::new(["mrol", "Maps.Example."]);
        let at = Some(ReachedAt::Address("192.168.1.2".parse().unwrap()));
        let check = |host: &'static str| hosts.check(&request("/", &[("host", host)], at)).is_ok();
        for own in [
            "localhost",
            "LocalHost:7333",
            "localhost.",
            "127.0.0.1",
            "127.8.9.1:1",
            "[::1]:7333",
            "192.168.1.2:7333",
            "mrol:7333",
            "maps.example",
            "[::ffff:127.0.0.1]",
        ] {
            assert!(check(own), "{own}");
        }
        for other in [
            "",
            "evil.example:7333",
            "localhost.evil.example",
            "192.168.1.3",
            "0.0.0.0",
            "127.0.0.1.nip.io",
            "::1::",
            "a b",
            "localhost@evil.example",
            "[::2]",
        ] {
            assert!(!check(other), "{other}");
        }
    }

    #[test]
    fn every_host_of_a_request_counts_and_none_is_refused_except_at_a_unix_socket() {
        let hosts = Hosts::default();
        let ok = |uri, headers: &[_], at| hosts.check(&request(uri, headers, at)).is_ok();
        assert!(ok("http://localhost:1/", &[], None));
        assert!(!ok("http://evil.example/", &[("host", "localhost")], None));
        assert!(!ok("http://localhost/", &[("host", "evil.example")], None));
        assert!(!ok("/", &[("host", "localhost"), ("host", "evil.example")], None));
        assert!(!ok("/", &[], None));
        assert!(ok("/", &[], Some(ReachedAt::UnixSocket)));
    }

    #[test]
    fn a_page_of_another_site_is_told_from_one_of_here() {
        let ok = |headers: &[_]| check_origin(&request("/", headers, None)).is_ok();
        let host = ("host", "localhost:7333");
        assert!(ok(&[host]));
        assert!(ok(&[host, ("origin", "http://localhost:7333")]));
        assert!(ok(&[("host", "maps.example"), ("origin", "https://maps.example")]));
        assert!(ok(&[host, ("sec-fetch-site", "same-origin")]));
        for foreign in
            ["http://evil.example", "null", "http://localhost:8080", "http://localhost", "file://", ""]
        {
            assert!(!ok(&[host, ("origin", foreign)]), "{foreign}");
        }
        assert!(!ok(&[host, ("sec-fetch-site", "cross-site")]));
        assert!(!ok(&[host, ("origin", "http://localhost:7333"), ("origin", "http://evil.example")]));
    }

    #[test]
    fn an_entry_of_the_settings_is_a_name_or_an_address() {
        for host in ["mrol", "maps.example", "10.0.0.1", "[::1]", "::1"] {
            assert!(is_host(host), "{host}");
        }
        for none in ["", "mrol:7333", "http://mrol", "*", "a b"] {
            assert!(!is_host(none), "{none}");
        }
    }
}
