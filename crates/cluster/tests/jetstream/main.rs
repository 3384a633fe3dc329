//! The log of a map in streams of real NATS servers, which are killed, halted and put back.
#![expect(clippy::unwrap_used, reason = "tests fail where their servers do")]

mod adopting;
mod bases;
mod beats;
mod connecting;
mod copies;
mod cutting;
#[expect(dead_code, reason = "the tests of a whole site use more of it")]
#[path = "../../../../tests/cluster/link.rs"]
mod link;
mod lost_servers;
mod nodes;
mod older_copies;
mod publishing;
mod random_kills;
mod reading;
mod shared_maps;
mod support;
mod versions;
