//! The list of maps that all nodes of a cluster share.

use std::fmt::Debug;

use bytes::Bytes;

use super::parts::Later;
use crate::error::ServiceError;
use mrol_map::map::{MapName, MapSettings};

/// The list of maps that all nodes of a cluster share. A call that succeeds returns once this node has its own copy, or
/// none any more; the others follow within a beat.
pub trait SharedCatalog: Debug + Send + Sync {
    /// Enters a map without voxels; false where there is one of that name already.
    ///
    /// # Errors
    /// `NoQuorum` where nobody acknowledges it: nothing was entered.
    fn create<'a>(
        &'a self,
        name: &'a MapName,
        settings: MapSettings,
    ) -> Later<'a, Result<bool, ServiceError>>;

    /// Enters a map that begins as this map file, which was checked.
    ///
    /// # Errors
    /// `MapExists` where there is one of that name, `NoQuorum` as above.
    fn restore<'a>(&'a self, name: &'a MapName, file: Bytes) -> Later<'a, Result<(), ServiceError>>;

    /// Takes a map out, for good: it is deleted on all nodes.
    ///
    /// # Errors
    /// `MapNotFound` where there is none, `NoQuorum` as above.
    fn delete<'a>(&'a self, name: &'a MapName) -> Later<'a, Result<(), ServiceError>>;
}
