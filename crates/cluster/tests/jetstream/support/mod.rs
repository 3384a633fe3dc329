//! NATS servers and writers of a log.

mod servers;
mod skipped;
mod writer;

pub(crate) use servers::{NatsServers, eventually};
pub(crate) use writer::{Writer, changes, claim, read_all, read_all_behind};
