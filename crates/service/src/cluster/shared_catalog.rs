//! The list of maps that all nodes of a cluster share.

use std::fmt::Debug;

use bytes::Bytes;
use uuid::Uuid;

use super::later::Later;
use crate::error::ServiceError;
use crate::replication::Base;
use crate::request::MapElsewhere;
use mrol_map::map::MapName;

/// A map that is to be shared.
#[derive(Debug, Clone)]
pub struct NewMap {
    /// Its uuid.
    pub uuid: Uuid,
    /// Where its log begins: with the map as it is in the file.
    pub base: Base,
    /// A map file.
    pub file: Bytes,
}

impl NewMap {
    /// Bytes of the file before compression: how much work it is to read it.
    pub fn body_bytes(&self) -> u64 {
        mrol_store::body_bytes(&self.file)
    }
}

/// The list of maps that all nodes of a cluster share. A call that succeeds returns once this node has its own copy of
/// the map, or none any more; the others follow within a beat.
pub trait SharedCatalog: Debug + Send + Sync {
    /// Enters a map; false where there is one of that name already. This node holds it, and so do as many others as the
    /// settings say.
    ///
    /// # Errors
    /// `NoQuorum` where nobody acknowledges it: nothing was entered. `OutcomeUnknown` where that is not known.
    /// `MapElsewhere` where there is one of that name that other nodes hold.
    fn enter<'a>(&'a self, name: &'a MapName, new: NewMap) -> Later<'a, Result<bool, ServiceError>>;

    /// True where a map that this node has no copy of is listed, and it has one now: another node has just made it.
    /// Asks NATS a few times a second at most, however many ask.
    ///
    /// # Errors
    /// `NoQuorum` where it is not known whether it is listed; `MapElsewhere`, with their addresses, where other nodes
    /// hold it.
    fn look_for<'a>(&'a self, name: &'a MapName) -> Later<'a, Result<bool, ServiceError>>;

    /// The maps that other nodes hold and this one does not, by name, as far as this node knows.
    fn held_elsewhere(&self) -> Vec<MapElsewhere>;

    /// Takes the map of this uuid out, for good: it is deleted on all nodes.
    ///
    /// # Errors
    /// `MapNotFound` where it is not listed under this name; `NoQuorum` and `OutcomeUnknown` as above.
    fn delete<'a>(&'a self, name: &'a MapName, uuid: Uuid) -> Later<'a, Result<(), ServiceError>>;
}
