//! The list of maps that all nodes share.
//!
//! It is one value, changed by compare-and-set as a whole: a name is given once, a map is renamed or deleted in one
//! step, and a server of NATS that lags is told by the value's revision. A thousand maps are a hundred kilobytes.
//!
//! Reading order: `error` is why it was not read or changed; `holders` are the nodes that hold a map, and `placement`
//! says besides which of them leads; `listing` is the value; `hints` tells that it was changed; `newest` tells it from
//! what a server that lags answers; `changes` reads and changes it at NATS.

mod changes;
mod error;
mod hints;
mod holders;
mod listing;
mod newest;
mod placement;

pub use changes::Catalog;
pub use error::CatalogError;
pub use hints::Hints;
pub use holders::Holders;
pub use listing::{Listing, MapEntry};
pub use placement::Placement;
