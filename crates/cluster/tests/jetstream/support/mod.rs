//! NATS servers and writers of a log.

#[expect(dead_code, reason = "tests of whole nodes use the rest")]
mod servers;
mod skipped;
mod writer;

pub(crate) use servers::{NatsServers, eventually};
pub(crate) use writer::{Writer, changes, claim, read_all, read_all_behind};
