//! Connections are secured, in both protocols, and certificates change without a restart.

#![cfg(feature = "server")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod authority;
mod command_line;
#[path = "../common/mod.rs"]
mod common;
mod expiry;
mod handshake;
#[path = "../process/mod.rs"]
mod process;
mod reloading;
mod settings;
