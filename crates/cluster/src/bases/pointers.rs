//! Which file is a map's base.

use uuid::Uuid;

use super::base::{from_json, to_json};
use super::error::BaseError;
use crate::bucket::Bucket;
use crate::engine::{Engine, StreamError};
use mrol_service::replication::Base;

/// Which file is the base of each map, in keys `base.UUID` of the bucket `mrol-maps`.
#[derive(Debug, Clone)]
pub struct BasePointers(Bucket);

impl BasePointers {
    /// The bucket, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine) -> Result<Self, StreamError> {
        Bucket::create(engine, "mrol-maps").map(Self)
    }

    /// The base of a map, and the revision that its next change expects; `None` where the map has none, and its next
    /// change expects 0. Of one server, which may lag: the change is refused then.
    ///
    /// # Errors
    /// What is there cannot be read, or nobody answered.
    pub fn read(&self, map: Uuid) -> Result<Option<(Base, u64)>, BaseError> {
        let Some(entry) = self.0.read(&key(map))? else { return Ok(None) };
        let damaged = |cause| BaseError::Damaged(format!("the base of map {map} cannot be read: {cause}"));
        let base = from_json(&entry.value).map_err(damaged)?;
        Ok(Some((base, entry.revision)))
    }

    /// The revision that the next change expects, also of a map whose base was forgotten.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn last_revision(&self, map: Uuid) -> Result<u64, BaseError> {
        Ok(self.0.last_revision(&key(map))?)
    }

    /// Makes a file, which is there, the base of a map, and says the new revision.
    ///
    /// # Errors
    /// [`BaseError::Changed`] where another did meanwhile, or nobody answered.
    pub fn change(&self, map: Uuid, base: &Base, expected: u64) -> Result<u64, BaseError> {
        let value = to_json(base).map_err(|error| BaseError::Unavailable(error.to_string()))?;
        Ok(self.0.put(&key(map), value.into(), Some(expected))?)
    }

    /// Forgets the base of a map that is deleted.
    ///
    /// # Errors
    /// [`BaseError::Changed`] where another changed it meanwhile, or nobody answered.
    pub fn forget(&self, map: Uuid, expected: u64) -> Result<(), BaseError> {
        Ok(self.0.delete(&key(map), expected)?)
    }
}

fn key(map: Uuid) -> String {
    format!("base.{map}")
}
