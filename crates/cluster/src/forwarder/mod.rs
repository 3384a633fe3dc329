//! Taking changes on to the node that leads a map: over gRPC, as a client of that node, under the secret of the cluster
//! and with the name of the caller's key.
//!
//! `settings` is what it is made of; `line` is one connection to another node, `peer` all that there are to it;
//! `failure` makes of a call that failed what the caller is told; `forward` makes the calls.

mod failure;
mod forward;
mod line;
mod peer;
mod settings;

pub use forward::Forwarder;
pub use settings::{ForwarderError, ForwarderSettings, NodeCertificate};
