//! [`Replica`]: what its readers hold.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::task::JoinHandle;

use super::error::ReplicaError;
use super::follow::Follower;
use super::options::ReplicaOptions;
use super::shared::Shared;
use super::status::ReplicaStatus;
use crate::client::Client;
use mrol_map::map::{MapName, MultiResolutionMap, Region};
use mrol_service::{Reason, ServiceError};

/// A copy of a map, or of a part of it, that follows the server's: it answers in this process, at a revision that it
/// names.
///
/// A task of the runtime that opened it follows the map until the replica is dropped. Where the connection breaks it
/// comes back and goes on from the last revision, so that it misses nothing and tells nothing twice; meanwhile the copy
/// answers as it is, up to the age that its options allow. Where the server refuses its key a few times in a row it
/// follows no longer. A map that was deleted and made again is another one, by its uuid, and is copied anew.
#[derive(Debug)]
pub struct Replica {
    pub(super) shared: Arc<Shared>,
    pub(super) region: Option<Region>,
    pub(super) field_bytes_max: usize,
    pub(super) age_max: Option<Duration>,
    following: JoinHandle<()>,
}

impl Drop for Replica {
    fn drop(&mut self) {
        self.following.abort();
    }
}

impl Replica {
    /// Copies `map`, and follows it from then on; returns when the copy is complete.
    ///
    /// # Errors
    /// When the server refuses or cannot be reached, or the map is larger than the options allow.
    pub async fn open(client: Client, map: MapName, options: ReplicaOptions) -> Result<Self, ReplicaError> {
        let mut follower = Follower::new(client, map, options);
        let (shared, watched) = follower.copy_first().await?;
        let following = tokio::spawn(follower.run(Arc::clone(&shared), watched));
        let ReplicaOptions { region, field_bytes_max, age_max, .. } = options;
        Ok(Self { shared, region, field_bytes_max, age_max, following })
    }

    /// How far the replica is.
    pub fn status(&self) -> ReplicaStatus {
        self.shared.status.borrow().clone()
    }

    /// Follows how far the replica is.
    pub fn statuses(&self) -> watch::Receiver<ReplicaStatus> {
        self.shared.status.subscribe()
    }

    /// How long ago the server was heard last: it tells something at least every `watch_heartbeat_s`, so that a copy of
    /// more age may lack changes, however the status says it is connected.
    pub fn age(&self) -> Duration {
        self.shared.age()
    }

    /// Refuses a copy whose server was heard longer ago than `age_max`: for a question whose answer must not be older.
    ///
    /// # Errors
    /// `Unavailable` with `replica_stale`.
    pub fn check_age(&self, age_max: Duration) -> Result<(), ReplicaError> {
        Ok(self.shared.check_age(Some(age_max))?)
    }

    /// Waits until the copy has `revision` of the map that it copies.
    ///
    /// # Errors
    /// `DeadlineExceeded` where it does not come within `wait_max`.
    pub async fn wait_for_revision(&self, revision: u64, wait_max: Duration) -> Result<(), ReplicaError> {
        let mut statuses = self.statuses();
        let reached = statuses.wait_for(|status| status.version.revision >= revision);
        match tokio::time::timeout(wait_max, reached).await {
            Ok(Ok(_)) => Ok(()),
            _ => {
                let at = self.status().version.revision;
                let message =
                    format!("revision {revision} did not come within {wait_max:?}: the copy is at {at}");
                Err(ServiceError::new(Reason::RevisionNotReached, message).into())
            }
        }
    }

    /// The copy: all that a map answers can be asked of it. It changes as the server's does, and a view of it is of one
    /// revision. A map that was made again is another one: ask for it anew now and then.
    ///
    /// It has the map's viewpoints unless the options say otherwise, of a region those that looked into it. It has no
    /// moments, so that alignment finds poses by overlap alone, and no trajectory.
    pub fn map(&self) -> Arc<MultiResolutionMap> {
        Arc::clone(&self.shared.copied.read().map)
    }
}

/// Refuses a level that the map has not.
pub(super) fn check_level(level: u32, map: &MultiResolutionMap) -> Result<(), ReplicaError> {
    let levels = map.settings().levels;
    if level < levels {
        return Ok(());
    }
    let message = format!("level must lie in 0..={}, got {level}", levels - 1);
    Err(ServiceError::new(Reason::LevelOutOfRange, message).into())
}
