//! What every request passes between its connection and its handler, the same in both protocols.
//!
//! ```text
//! request id -> operation -> access (key, site) -> span -> admission (limits) -> handler -> answer -> metrics, audit
//! ```
//!
//! What differs between gRPC and HTTP is the trait [`Protocol`].

mod protocol;
mod serve;

pub use protocol::Protocol;
pub use serve::Middleware;
