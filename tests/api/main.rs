//! What a running server promises: both protocols, bad input, its beginning, its limits and its end.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod admin_listener;
mod bad_input;
mod blocks;
mod callers_gone;
mod carving;
mod description;
mod deskewing;
mod events;
mod grpc;
mod hanging_disk;
mod http;
mod keep_outs;
mod lifecycle;
mod localize;
mod memory_returns;
mod observers;
mod query_only;
mod questions;
mod recovery;
mod regions;
mod renaming;
mod scan_requests;
mod sensors;
mod sessions;
mod several_servers;
#[path = "../support/mod.rs"]
mod support;
mod trajectory;
mod unix_socket;
mod watch;
mod watermarks;
