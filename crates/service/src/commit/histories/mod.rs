//! Random histories of three nodes that share a map over a log that fails: nothing acknowledged is missing, nothing is
//! applied twice, and all nodes are equal at every revision. Where a rule is left out, histories show it.
//!
//!     MROL_HISTORIES=100000 cargo test --package mrol-service --lib histories
//!     MROL_HISTORY=116 cargo test --package mrol-service --lib histories -- --nocapture
//!
//! The last tells one alone, step by step.
//!
//! `node` is a worker on a simulated disk, `history` what happens to three of them, `check` what must hold, `tests`
//! many histories; `faults` are single ones that somebody thought of.

mod changes;
mod check;
mod faults;
mod history;
mod node;
mod tests;
