//! The other nodes of a cluster, as the operations of one of them see them: [`Forward`] asks the node that leads a map,
//! [`SharedCatalog`] is the list of maps that all nodes share, [`NoRoom`] what keeps one of them from taking more.

mod forward;
mod later;
mod no_room;
mod parts;
mod shared_catalog;

pub use forward::{Forward, ForwardedCall, ForwardedEvents};
pub use later::Later;
pub use no_room::NoRoom;
pub use parts::Cluster;
pub use shared_catalog::{NewMap, SharedCatalog};
