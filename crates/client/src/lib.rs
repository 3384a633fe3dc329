//! A client of the server, in domain types: a method for each call, and nothing of the daemon.
//!
//! ```no_run
//! use mrol_client::Client;
//! use mrol_client::geometry::Point;
//! use mrol_client::map::{Lookup, MapName};
//! use mrol_client::service::PointQuery;
//!
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let client = Client::connect("http://127.0.0.1:7334").await?;
//! let query = PointQuery {
//!     points: vec![Point::new(1.0, 2.0, 0.5), Point::new(1.0, 2.0, 0.6)].into(),
//!     map_from_points: None,
//!     level: 0,
//!     lookup: Lookup::Exact,
//!     min_revision: None,
//!     map_uuid: None,
//!     keep_out: false,
//! };
//! let answer = client.query_points(&MapName::new("demo")?, query).await?;
//! println!("{} of {} points are occupied", answer.points_occupied, answer.points);
//! # Ok(())
//! # }
//! ```
//!
//! A [`Client`] is a handle on one connection: clones share it, and calls on it run at the same time. The domain types
//! that it takes are those of the map and of the service, whose modules are here too.

mod addresses;
mod answers;
mod calls;
mod client;
mod connection;
mod credentials;
mod elsewhere;
mod error;
mod events;
mod keep_outs;
mod new_map;
mod node_client;
mod question;
mod repeat;
mod replica;
mod sending;
mod servers;
mod streams;
mod told_revisions;
mod watch;
pub mod wire;

pub use addresses::addresses;
pub use answers::Answers;
pub use client::{Client, new_session};
pub use credentials::Credentials;
pub use error::ClientError;
pub use mrol_map::{align, bloom, geometry, map, mapping, planning, scan, util, visibility, voxel};
pub use mrol_service as service;
pub use new_map::{NewFilter, NewMap};
pub use node_client::{ConnectionUse, NodeClient};
pub use replica::{
    BLOCKS_MAX_DEFAULT, Replica, ReplicaError, ReplicaOptions, ReplicaStatus, VIEWPOINT_BYTES_MAX_DEFAULT,
};
