//! Where a server answers.

use std::fmt;
use std::fmt::Display;
use std::net::SocketAddr;

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

impl Display for Serving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.tls { "https" } else { "http" };
        write!(f, "mrol serves {scheme}://{} (HTTP) and {scheme}://{} (gRPC)", self.http, self.grpc)?;
        self.admin.map_or(Ok(()), |admin| write!(f, "; health and metrics also at {scheme}://{admin}"))
    }
}
