//! The list of maps at NATS: read, and changed by compare-and-set.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use parking_lot::Mutex;
use uuid::Uuid;

use super::error::CatalogError;
use super::hints::Hints;
use super::holders::Holders;
use super::listing::Listing;
use super::newest::{Newest, Read};
use crate::bucket::{Bucket, BucketError};
use crate::engine::{Engine, StreamError};

/// Key of the list in its bucket.
const KEY: &str = "maps";

/// How long a change is tried: NATS elects a leader in some seconds.
const CHANGED_WITHIN: Duration = Duration::from_secs(6);
/// Pause before another attempt.
const PAUSE: Duration = Duration::from_millis(50);

/// The list of maps, in the bucket `mrol-catalog`.
#[derive(Debug, Clone)]
pub struct Catalog {
    bucket: Bucket,
    newest: Arc<Mutex<Newest>>,
}

impl Catalog {
    /// The bucket, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine) -> Result<Self, StreamError> {
        let bucket = Bucket::create(engine, "mrol-catalog")?;
        Ok(Self { bucket, newest: Arc::default() })
    }

    /// What wakes whoever follows the list.
    pub fn hints(&self, engine: &Engine) -> Hints {
        Hints::of(engine, self.bucket.subject(KEY))
    }

    /// The list and its revision, which grows with each change: no older one than was seen before, unless all that is
    /// read is older for ten seconds, since an older copy was put back.
    ///
    /// # Errors
    /// Nobody answered, or only a server that lags; or what is there is no list.
    pub fn read(&self) -> Result<(Listing, u64), CatalogError> {
        let entry = self.bucket.read(KEY).map_err(|error| CatalogError::Unavailable(error.to_string()))?;
        let revision = entry.as_ref().map_or(0, |entry| entry.revision);
        let read = self.newest.lock().read(revision, Instant::now());
        match read {
            Read::List => {}
            Read::PutBack => tracing::warn!(revision, "an older copy of the list of maps was put back"),
            Read::Late => return Err(CatalogError::Unavailable("a server lags".to_owned())),
        }
        let Some(entry) = entry else { return Ok((Listing::default(), 0)) };
        let listing = serde_json::from_slice(&entry.value);
        Ok((listing.map_err(|error| CatalogError::Damaged(error.to_string()))?, revision))
    }

    /// Enters a map that these nodes are to hold, and says which map has the name: this one, or another that had it
    /// before.
    ///
    /// # Errors
    /// Says whether it may be there.
    pub fn enter(&self, name: &MapName, uuid: Uuid, holders: &Holders) -> Result<Uuid, CatalogError> {
        self.change(|listing| match listing.check_place(name, uuid)? {
            Some(there) => Ok((there, false)),
            None => {
                listing.enter(name, uuid, holders);
                Ok((uuid, true))
            }
        })
    }

    /// Takes a map out for good; false where there is none of that name. `uuid` is the map that was meant: where
    /// another has its name by now, nothing is done.
    ///
    /// # Errors
    /// Says whether it may be deleted.
    pub fn delete(&self, name: &MapName, uuid: Uuid) -> Result<bool, CatalogError> {
        self.change(|listing| match listing.map(name) {
            Some(there) if there.uuid == uuid => Ok((listing.delete(name).is_some(), true)),
            _ => Ok((listing.is_deleted(uuid), false)),
        })
    }

    /// Says which node is to lead a map; false where there is no such map.
    ///
    /// # Errors
    /// Says whether it may be changed.
    pub fn set_leader(&self, name: &MapName, leader: Option<&NodeName>) -> Result<bool, CatalogError> {
        self.change(|listing| {
            let is_so = listing.map(name).is_some_and(|entry| entry.leader().as_ref() == leader);
            Ok((is_so || listing.set_leader(name, leader), !is_so))
        })
    }

    /// Says which nodes are to hold a map; false where there is no such map.
    ///
    /// # Errors
    /// Says whether it may be changed.
    pub fn set_holders(&self, name: &MapName, holders: &Holders) -> Result<bool, CatalogError> {
        self.change(|listing| {
            let is_so = listing.map(name).is_some_and(|entry| entry.holders() == *holders);
            Ok((is_so || listing.set_holders(name, holders), !is_so))
        })
    }

    /// Forgets maps that were deleted, of which no node has a copy any more.
    ///
    /// # Errors
    /// Says whether it may be changed.
    pub fn forget(&self, deleted: &BTreeSet<Uuid>) -> Result<(), CatalogError> {
        self.change(|listing| {
            let is_due = listing.deleted().any(|uuid| deleted.contains(&uuid));
            listing.forget(deleted);
            Ok(((), is_due))
        })
    }

    /// Changes the list by compare-and-set. `change` says what to answer, and whether the list is another now; it is
    /// called again on the list as it is then, where that was changed by another, or by itself without a word.
    fn change<T>(
        &self,
        change: impl Fn(&mut Listing) -> Result<(T, bool), CatalogError>,
    ) -> Result<T, CatalogError> {
        let until = Instant::now() + CHANGED_WITHIN;
        let mut is_unknown = false;
        loop {
            let why = match self.changed_once(&change) {
                Ok(answer) => return Ok(answer),
                Err(Attempt::Failed(error)) => return Err(error),
                Err(Attempt::NotRead(why)) => why,
                Err(Attempt::Overtaken) => "it was changed by others again and again".to_owned(),
                Err(Attempt::NotAcknowledged(why)) => {
                    is_unknown = true;
                    why
                }
            };
            if Instant::now() >= until {
                return Err(match is_unknown {
                    true => CatalogError::Unknown(why),
                    false => CatalogError::Unavailable(why),
                });
            }
            thread::sleep(PAUSE);
        }
    }

    fn changed_once<T>(
        &self,
        change: impl Fn(&mut Listing) -> Result<(T, bool), CatalogError>,
    ) -> Result<T, Attempt> {
        let (mut listing, revision) = self.read().map_err(|error| match error {
            CatalogError::Unavailable(why) => Attempt::NotRead(why),
            error => Attempt::Failed(error),
        })?;
        let (answer, is_changed) = change(&mut listing).map_err(Attempt::Failed)?;
        if is_changed {
            let value = serde_json::to_vec(&listing);
            let value =
                value.map_err(|error| Attempt::Failed(CatalogError::Unavailable(error.to_string())))?;
            let put = self.bucket.put(KEY, value.into(), Some(revision));
            let put = put.map_err(|error| match error {
                BucketError::Changed => Attempt::Overtaken,
                error @ BucketError::Unavailable { .. } => Attempt::NotAcknowledged(error.to_string()),
            })?;
            self.newest.lock().made(put);
        }
        Ok(answer)
    }
}

/// Why an attempt changed nothing, as far as is known.
enum Attempt {
    NotRead(String),
    Overtaken,
    NotAcknowledged(String),
    Failed(CatalogError),
}
