//! Who may do what: every RPC and every route has a rule, and the rule holds.

#![cfg(feature = "server")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod asking;
mod audit;
mod browsers;
#[path = "../common/mod.rs"]
mod common;
mod disclosure;
mod early;
mod keyring;
mod lifetimes;
mod listening;
mod paths;
#[path = "../process/mod.rs"]
mod process;
mod reloading;
mod requests;
mod robots;
mod table;
