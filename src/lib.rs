//! A networked multi-resolution voxel map: Ryde and Corso, *Fast Voxel Maps with Counting Bloom Filters*
//! (IROS 2012), as a server.

pub mod align;
pub mod bloom;
#[cfg(feature = "server")]
pub mod cli;
#[cfg(feature = "client")]
pub mod client;
#[cfg(feature = "server")]
pub mod config;
pub mod geometry;
#[cfg(feature = "server")]
pub mod grpc;
#[cfg(feature = "server")]
pub mod http;
#[cfg(feature = "server")]
pub mod lifecycle;
pub mod map;
pub mod scan;
#[cfg(feature = "server")]
pub mod server;
#[cfg(feature = "client")]
pub mod service;
#[cfg(feature = "client")]
pub mod store;
#[cfg(feature = "server")]
pub mod telemetry;
pub mod voxel;
#[cfg(feature = "client")]
pub mod wire;
