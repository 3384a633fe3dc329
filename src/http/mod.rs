//! The HTTP adapters, with the same meaning as gRPC: JSON for people, bytes for programs.

mod adapter;
mod error;
mod forms;
mod headers;
mod middleware;
mod openapi;
mod operations;
mod pieces;
mod probes;
mod question;
mod reader;
mod router;
mod routes;
mod scrapes;
mod starting;
mod viewer;

pub use openapi::openapi_json;
pub use router::{admin_router, router};
pub use starting::{admin_starting, starting};
