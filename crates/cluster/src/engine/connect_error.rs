//! Why there is no connection.

use std::path::PathBuf;

/// Why a node could not begin to work with NATS, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// No server answered.
    #[error("no NATS server at {servers} answered ({cause}): start one, or correct the addresses")]
    NoServer {
        /// The addresses.
        servers: String,
        /// What the last attempt ended with.
        cause: String,
    },
    /// A server refused user, password or key.
    #[error(
        "NATS at {servers} refused the credentials ({cause}): give a password in the address, a .creds file or an nkey \
         of a user that may publish and subscribe to mrol.>, $JS.API.>, $KV.>, $O.> and _INBOX.>"
    )]
    Unauthorized {
        /// The addresses.
        servers: String,
        /// What the server said.
        cause: String,
    },
    /// TLS could not be set up.
    #[error(
        "no TLS with NATS at {servers} ({cause}): give the file of certificates that signed theirs, and names that \
         they are for"
    )]
    Tls {
        /// The addresses.
        servers: String,
        /// What failed.
        cause: String,
    },
    /// A file of credentials could not be read.
    #[error("credentials for NATS could not be read from {}: {cause}", path.display())]
    Credentials {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: String,
    },
    /// The server has no JetStream, or not for this user.
    #[error(
        "NATS at {servers} has no JetStream for this user ({cause}): nats-server.conf needs \
         `jetstream {{ store_dir: ..., sync_interval: always }}`, and a user's account `jetstream: enabled`"
    )]
    NoJetStream {
        /// The addresses.
        servers: String,
        /// What the server said.
        cause: String,
    },
    /// JetStream does not answer.
    #[error(
        "JetStream at {servers} does not answer ({cause}): most of the NATS servers must run and reach each other; \
         right after their start, wait for ten seconds"
    )]
    NoQuorum {
        /// The addresses.
        servers: String,
        /// What the request ended with.
        cause: String,
    },
    /// The server is older than what this crate asks of it.
    #[error("NATS at {servers} is {version}: 2.11 or newer is needed")]
    TooOld {
        /// The addresses.
        servers: String,
        /// The server's version.
        version: String,
    },
    /// Messages would not fit.
    #[error(
        "NATS at {servers} takes messages of {max_payload} bytes: set `max_payload: 1MB` in nats-server.conf"
    )]
    SmallPayload {
        /// The addresses.
        servers: String,
        /// Largest message, in bytes.
        max_payload: usize,
    },
    /// No thread for the connection.
    #[error("no thread for the connection to NATS: {0}")]
    NoThread(std::io::Error),
}
