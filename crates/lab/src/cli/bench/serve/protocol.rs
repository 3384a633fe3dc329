//! Protocols of the queries.

use clap::ValueEnum;

/// Protocol of the queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Protocol {
    /// gRPC, a call a message
    Grpc,
    /// gRPC, one stream of messages
    GrpcStream,
    /// HTTP, points and bitmap as bytes
    Http,
}
