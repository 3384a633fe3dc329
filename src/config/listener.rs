//! Sections `http` and `grpc` of the settings.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use mrol_service::section;

section! {
    /// Addresses at which a protocol is served.
    pub struct ListenerConfig in "http" {
        /// Address and port to listen at; port 0 takes a free one.
        listen: SocketAddr = (Ipv4Addr::LOCALHOST, 7333).into(); none;
        /// Path of a Unix socket to serve at as well.
        socket: Option<PathBuf> = None; none;
    }
}
