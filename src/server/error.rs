//! Why there is no server any more, or none from the beginning.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use super::tls::TlsError;
use crate::access::{ClusterSecretError, KeyFileError};
use crate::config::ConfigError;
use crate::telemetry::TelemetryError;
use mrol_service::ServiceError;

/// Why the server could not start, or stopped.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The maps cannot be opened.
    #[error("the maps cannot be opened: {0}")]
    Open(ServiceError),
    /// The program was built without clusters.
    #[error(
        "this program was built without clusters, which `cluster.nats` and `mrol cluster` take: build it by \
         `cargo build --release --bin mrol --features cluster`; released programs and the container have them"
    )]
    NoClusters,
    /// The secret of the cluster cannot be read.
    #[error(transparent)]
    ClusterSecret(#[from] ClusterSecretError),
    /// Other nodes cannot be asked.
    #[cfg(feature = "cluster")]
    #[error("the other nodes of the cluster cannot be asked: {0}")]
    Forwarder(#[from] mrol_cluster::ForwarderError),
    /// A setting is missing.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An address cannot be listened on.
    #[error("{protocol} cannot listen on {address}: {error}")]
    Listen {
        /// `http`, `grpc` or `admin`.
        protocol: &'static str,
        /// The address.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// A Unix socket cannot be listened on.
    #[error("{protocol} cannot listen on {}: {error}", path.display())]
    Socket {
        /// `http` or `grpc`.
        protocol: &'static str,
        /// The socket's file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Other machines could do everything, since there are no keys.
    #[error(
        "{protocol} would let whoever reaches {address} do everything: name a file of keys (access.keys_file or \
         --keys-file; `mrol key new` makes keys), listen on loopback, or say that this is meant (access.open or \
         --insecure-open)"
    )]
    Unguarded {
        /// `http` or `grpc`.
        protocol: &'static str,
        /// The address.
        address: SocketAddr,
    },
    /// The file of keys is none.
    #[error("access.keys_file: {0}")]
    Keys(#[from] KeyFileError),
    /// Connections cannot be secured.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// Its threads cannot be started, or one panicked.
    #[error("{0}")]
    Runtime(String),
    /// Log or metrics.
    #[error(transparent)]
    Telemetry(#[from] TelemetryError),
    /// The contract that was compiled in is broken.
    #[error("reflection: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// A part of the server stopped by itself.
    #[error("{0} stopped: {1}")]
    Stopped(&'static str, String),
    /// A disk that hangs kept the maps from being written at the end.
    #[error(
        "saving the maps took longer than {0:?} (drain_seconds, at least 5 s): a disk hangs or is slow. Nothing \
         acknowledged is lost, the journals have it; the next start takes longer"
    )]
    SavingTooLong(Duration),
    /// The maps could not be written at the end.
    #[error("the maps cannot be saved: {0}")]
    Save(ServiceError),
}
