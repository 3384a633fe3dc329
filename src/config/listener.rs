//! Where a protocol is served.

use std::net::SocketAddr;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Where a protocol is served.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListenerConfig {
    /// Address and port; port 0 takes a free one.
    pub listen: SocketAddr,
    /// The file of a Unix socket to serve at as well; none.
    #[serde(default)]
    pub socket: Option<PathBuf>,
}
