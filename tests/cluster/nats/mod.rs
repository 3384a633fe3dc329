//! Servers of NATS for tests, as those of `crates/cluster` have them.

#[path = "../../../crates/cluster/tests/jetstream/support/servers.rs"]
mod servers;
#[path = "../../../crates/cluster/tests/jetstream/support/skipped.rs"]
pub(crate) mod skipped;

pub(crate) use servers::{NatsServers, copy_folder, free_ports};
