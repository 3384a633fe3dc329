//! The locks of a map.
//!
//! With the feature `shuttle`, which is for one test alone (`tests/commit_protocol.rs`), they are those of a model
//! checker: it runs a test's threads one at a time, and at every lock chooses who goes on.

#[cfg(feature = "shuttle")]
mod modelled;

#[cfg(feature = "shuttle")]
pub(super) use self::modelled::{
    Mutex, MutexGuard, RwLock, RwLockReadGuard, RwLockUpgradableReadGuard, RwLockWriteGuard,
};
#[cfg(not(feature = "shuttle"))]
pub(super) use parking_lot::{
    Mutex, MutexGuard, RwLock, RwLockReadGuard, RwLockUpgradableReadGuard, RwLockWriteGuard,
};
#[cfg(feature = "shuttle")]
pub(super) use shuttle::sync::atomic::AtomicU64;
#[cfg(not(feature = "shuttle"))]
pub(super) use std::sync::atomic::AtomicU64;
