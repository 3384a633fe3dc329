//! The daemon: its sockets, and going down within a bound.

mod access_policy;
mod background;
mod bound;
mod connection;
mod connection_slots;
mod daemon;
mod endpoint;
mod error;
mod expiry;
mod files;
mod handshakes;
mod listener;
#[cfg(feature = "cluster")]
mod membership;
#[cfg(not(feature = "cluster"))]
#[path = "no_membership.rs"]
mod membership;
mod opening;
mod protocol;
mod rlimit;
mod signal;
mod socket;
mod starting;
mod stream;
mod system_readings;
mod tls;
mod tracked_body;
mod watch;

pub use bound::Server;
pub use daemon::{Daemon, Taken};
pub use error::ServerError;
pub use files::ReloadableFiles;
#[cfg(feature = "cluster")]
pub use membership::engine_settings;
pub use signal::{Hangups, exit_after, exit_when_told, shutdown_signal};
pub use tls::TlsError;
