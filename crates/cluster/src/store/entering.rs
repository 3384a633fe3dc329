//! A map is put at NATS and listed, or taken away.

use mrol_map::map::MapName;
use mrol_service::NewMap;
use uuid::Uuid;

use super::opening::ClusterStore;
use crate::catalog::{CatalogError, Holders};
use crate::jetstream_log::JetStreamLog;

/// Why a map was not entered into a cluster.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EnterError {
    /// Its base or its log could not be put: it is not listed.
    #[error("{0}")]
    NotPut(String),
    /// The list was not read or changed.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
}

impl ClusterStore {
    /// Enters a map that these nodes are to hold: puts its base, makes its log, and then lists it, so that what the
    /// list names is there. Says which map has the name: this one, or another that had it before. A map that is listed
    /// already stays as it is; what an attempt before this one left is put again. Not for an async thread.
    ///
    /// # Errors
    /// Says whether the map may be listed.
    pub fn enter(&self, name: &MapName, new: &NewMap, holders: &Holders) -> Result<Uuid, EnterError> {
        let (listing, _) = self.catalog.read()?;
        if let Some(there) = listing.check_place(name, new.uuid)? {
            return Ok(there);
        }
        self.put(new)?;
        let entered = self.catalog.enter(name, new.uuid, holders);
        let may_be_there = match &entered {
            Ok(there) => *there == new.uuid,
            Err(error) => matches!(error, CatalogError::Unknown(_) | CatalogError::OtherName(_)),
        };
        if !may_be_there && let Err(error) = self.remove(new.uuid) {
            tracing::debug!(error, "what was put for a map that was not entered is still there");
        }
        Ok(entered?)
    }

    /// Puts a further copy of a map in the place of the one that its log begins with, while no node has begun with
    /// that: none was ever started with this NATS. Says the revision of the one that was there before. Not for an async
    /// thread.
    ///
    /// # Errors
    /// Says why the copy was not put.
    pub fn begin_further(&self, NewMap { uuid, base, file }: &NewMap) -> Result<u64, EnterError> {
        let failed = |error: &dyn std::fmt::Display| EnterError::NotPut(error.to_string());
        let there = self.pointers.read(*uuid).map_err(|error| failed(&error))?;
        let (before, revision) = there.ok_or_else(|| failed(&format!("map {uuid} has no base")))?;
        if before.revision >= base.revision {
            return Ok(before.revision);
        }
        let log = JetStreamLog::open(&self.engine, *uuid).map_err(|error| failed(&error))?;
        let check_unused = || {
            let why = |begun: String| failed(&format!("{begun}: end all nodes, and begin with a new NATS"));
            if let Some(beat) = self.beats.read().map_err(|error| failed(&error))?.first() {
                return Err(why(format!("node {} was started with an older copy", beat.node)));
            }
            match log.used().map_err(|error| failed(&error))?.last_sequence {
                0 => Ok(()),
                _ => Err(why("a node has begun with an older copy".to_owned())),
            }
        };
        check_unused()?;
        self.bases.put(*uuid, base, file).map_err(|error| failed(&error))?;
        let changed = self.pointers.change(*uuid, base, revision).map_err(|error| failed(&error))?;
        // A node that was started meanwhile beats before it claims, and looks where the log begins before it leads.
        if let Err(error) = check_unused() {
            self.pointers.change(*uuid, &before, changed).map_err(|error| failed(&error))?;
            return Err(error);
        }
        if let Err(error) = self.bases.delete(*uuid, &before) {
            tracing::debug!(%error, "the copy that was there before is still there");
        }
        Ok(before.revision)
    }

    fn put(&self, NewMap { uuid, base, file }: &NewMap) -> Result<(), EnterError> {
        let failed = |error: &dyn std::fmt::Display| EnterError::NotPut(error.to_string());
        let log = JetStreamLog::create(&self.engine, *uuid).map_err(|error| failed(&error))?;
        let used = log.used().map_err(|error| failed(&error))?;
        if used.last_sequence > 0 {
            let message = format!(
                "NATS has a log of map {uuid} with {} messages, and no map of that uuid is listed: it was in the cluster \
                 before",
                used.messages
            );
            return Err(EnterError::NotPut(message));
        }
        let expected = self.pointers.last_revision(*uuid).map_err(|error| failed(&error))?;
        self.bases.put(*uuid, base, file).map_err(|error| failed(&error))?;
        self.pointers.change(*uuid, base, expected).map_err(|error| failed(&error))?;
        Ok(())
    }

    /// Removes what NATS has of a map that is not listed: its log, its base and what points there.
    ///
    /// # Errors
    /// NATS did not answer.
    pub(crate) fn remove(&self, uuid: Uuid) -> Result<(), String> {
        JetStreamLog::delete(&self.engine, uuid).map_err(|error| error.to_string())?;
        if let Some((base, revision)) = self.pointers.read(uuid).map_err(|error| error.to_string())? {
            self.bases.delete(uuid, &base).map_err(|error| error.to_string())?;
            self.pointers.forget(uuid, revision).map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}
