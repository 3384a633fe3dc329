//! The gRPC adapters: convert in, call the service, convert out.

mod adapter;
mod deadline;
mod decompression;
mod former;
mod mapping;
pub(super) mod maps;
mod message_framing;
mod middleware;
mod not_grpc;
mod occupancy;
mod question;
mod status;
mod stream;
mod stubs;

pub use adapter::{Health, routes};
