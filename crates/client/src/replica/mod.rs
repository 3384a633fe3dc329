//! A copy of a map in this process, which follows the server's.
//!
//! ```no_run
//! use mrol_client::{Client, Replica, ReplicaOptions};
//! use mrol_client::map::MapName;
//! use mrol_client::service::PointQuery;
//!
//! # async fn example(query: PointQuery) -> Result<(), Box<dyn std::error::Error>> {
//! let client = Client::connect("http://127.0.0.1:7334").await?;
//! let replica = Replica::open(client, MapName::new("demo")?, ReplicaOptions::default()).await?;
//! let answer = replica.query_points(&query)?; // No call goes out.
//! println!("{} occupied at revision {}", answer.points_occupied, answer.version.revision);
//! # Ok(())
//! # }
//! ```

mod block;
mod copy;
mod error;
mod follow;
mod handle;
mod options;
mod points;
mod question;
mod shared;
mod status;
#[cfg(test)]
mod tests;

pub use error::ReplicaError;
pub use handle::Replica;
pub use options::{BLOCKS_MAX_DEFAULT, ReplicaOptions, VIEWPOINT_BYTES_MAX_DEFAULT};
pub use status::ReplicaStatus;
