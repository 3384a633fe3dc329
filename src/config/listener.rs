//! Sections `http` and `grpc` of the settings.

use std::net::SocketAddr;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Addresses at which a protocol is served.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListenerConfig {
    /// Address and port to listen at; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Path of a Unix socket to serve at as well; none.
    #[serde(default)]
    pub socket: Option<PathBuf>,
}
