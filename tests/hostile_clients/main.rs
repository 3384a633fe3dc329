//! Clients that mean harm, one kind after another against the real program, beside honest ones: memory stays under the
//! sum of the limits, `/livez` answers throughout, and the honest clients are served.
//!
//! What is bounded by the clock here is generous, since tests run on busy machines. The strict form:
//! `MROL_LIVEZ_MS=100 cargo test --release --test hostile_clients -- --nocapture`.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod bombs;
mod control_group;
mod floods;
mod frames;
mod headers;
mod health;
mod honest;
mod idle;
mod map_files;
mod metrics;
mod probe;
mod siege;
mod silence;
mod slowness;
#[path = "../support/mod.rs"]
mod support;
mod unread;
