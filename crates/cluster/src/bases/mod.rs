//! Bases of maps: map files that stand for what is cut from the front of a log.
//!
//! Reading order: `base` is what is known of one; `error` is what may go wrong; `store` holds the files; `pointers`
//! says which file is a map's base; `sweep` deletes what nothing points to.

mod base;
mod error;
mod pointers;
mod store;
mod sweep;

pub use error::BaseError;
pub use pointers::BasePointers;
pub use store::BaseStore;
pub use sweep::Orphans;
