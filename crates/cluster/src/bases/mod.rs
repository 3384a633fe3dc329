//! Bases of maps: map files that stand for what is cut from the front of a log.
//!
//! Reading order: `base` is what is known of one; `error` is what may go wrong; `store` holds the files; `pointers`
//! says which of them is a map's base.

mod base;
mod error;
mod pointers;
mod store;

pub use error::BaseError;
pub use pointers::BasePointers;
pub use store::BaseStore;
