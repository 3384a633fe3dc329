//! Taking changes on to the node that leads a map: over gRPC, as a client of that node, under the secret of the cluster
//! and with the name of the caller's key.
//!
//! `settings` is what it is made of; `peer` holds the connection to one other node; `failure` makes of a call that
//! failed what the caller is told; `forward` makes the calls.

mod failure;
mod forward;
mod peer;
mod settings;

pub use forward::Forwarder;
pub use settings::{ForwarderError, ForwarderSettings, NodeCertificate};
