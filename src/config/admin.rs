//! Section `admin` of the settings.

use std::net::SocketAddr;

use mrol_service::section;

section! {
    /// Settings of the listener for health and metrics alone.
    pub struct AdminConfig in "admin" {
        /// Address and port at which `/livez`, `/readyz` and `/metrics` are served once more, and nothing else: for
        /// monitors in a network of their own. What fills the main ports does not reach it.
        listen: Option<SocketAddr> = None; none;
    }
}
