//! Where a server answers.

use std::fmt;
use std::fmt::Display;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use serde::Serialize;

use crate::server::Server;

/// Addresses of a running server.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Serving {
    /// Address of HTTP.
    pub http: SocketAddr,
    /// Address of gRPC.
    pub grpc: SocketAddr,
    /// Address of health and metrics alone, where they have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub admin: Option<SocketAddr>,
    /// True when clients must use TLS.
    pub tls: bool,
}

impl Serving {
    /// The addresses of `server`.
    pub fn of(server: &Server) -> Self {
        Self {
            http: server.http_address(),
            grpc: server.grpc_address(),
            admin: server.admin_address(),
            tls: server.is_secured(),
        }
    }
}

impl Serving {
    /// The address of the page that shows the maps, as a browser on this machine takes it.
    pub fn page(&self) -> String {
        let Self { mut http, tls, .. } = *self;
        match http.ip() {
            IpAddr::V4(all) if all.is_unspecified() => http.set_ip(Ipv4Addr::LOCALHOST.into()),
            IpAddr::V6(all) if all.is_unspecified() => http.set_ip(Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        format!("{}://{http}/", if tls { "https" } else { "http" })
    }
}

impl Display for Serving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.tls { "https" } else { "http" };
        write!(f, "mrol serves {scheme}://{} (HTTP) and {scheme}://{} (gRPC)", self.http, self.grpc)?;
        self.admin.map_or(Ok(()), |admin| write!(f, "; health and metrics also at {scheme}://{admin}"))?;
        write!(f, "\nSee the maps in a browser: {}", self.page())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_named_as_a_browser_on_this_machine_reaches_it() {
        let page = |http: &str, tls| {
            let (http, grpc) = (http.parse().unwrap(), "127.0.0.1:7334".parse().unwrap());
            let serving = Serving { http, grpc, admin: None, tls };
            assert!(serving.to_string().ends_with(&serving.page()), "{serving}");
            serving.page()
        };
        assert_eq!(page("127.0.0.1:7333", false), "http://127.0.0.1:7333/");
        assert_eq!(page("0.0.0.0:7333", false), "http://127.0.0.1:7333/");
        assert_eq!(page("[::]:7333", true), "https://[::1]:7333/");
        assert_eq!(page("10.0.0.7:80", false), "http://10.0.0.7:80/");
    }
}
