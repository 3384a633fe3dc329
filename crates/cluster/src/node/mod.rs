//! A node of the cluster: a server that shares its maps with others.
//!
//! Reading order; none names a file of a later line:
//!
//! 1. `settings`, `view`: what a node is made of, and what it sees of the others.
//! 2. `room`, `choice`, `release`: who is to hold a new map, who is to lead one, and when a copy is dropped that others
//!    hold, by what is seen.
//! 3. `blocking`: questions to NATS, which block.
//! 4. `lag`: whether it is where the others are.
//! 5. `own_beats`, `heart`: beats every two seconds, as long as no other process has the node's name, and sees who is
//!    gone.
//! 6. `cutting`, `sweeping`: puts a base and cuts the front of a log off; deletes what nothing points to.
//! 7. `claimed`, `so_far`: what a node waits for that has claimed a map, and what it has seen so far of who leads one.
//! 8. `keeper`: keeps this node's copy of one map, and leads it where it is to.
//! 9. `keepers`: one for each map of the cluster's list that this node holds.
//! 10. `entering`: enters maps into the list and deletes them, for the operations of the service.
//! 11. `server`: [`Node`], which puts these together.

mod blocking;
mod choice;
mod claimed;
mod cutting;
mod entering;
mod heart;
mod keeper;
mod keepers;
mod lag;
mod own_beats;
mod release;
mod room;
mod server;
mod settings;
mod so_far;
mod sweeping;
mod view;

pub use server::{Node, NodeStatus};
pub use settings::{BaseLimits, NodeSettings};
