//! The list of maps that all nodes share.
//!
//! It is one value, changed by compare-and-set as a whole: a name is given once, a map is renamed or deleted in one
//! step, and a server of NATS that lags is told by the value's revision. A thousand maps are a hundred kilobytes.
//!
//! Reading order: `error` is why it was not read or changed; `listing` is the value; `changes` reads and changes it at
//! NATS; `hints` tells that it was changed.

mod changes;
mod error;
mod hints;
mod listing;

pub use changes::Catalog;
pub use error::CatalogError;
pub use hints::Hints;
pub use listing::{Listing, MapEntry};
