//! Spectators: replicas that note what they see.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::task::JoinHandle;

use super::address::GrpcAddress;
use super::error::FleetError;
use super::ledger::Sighting;
use mrol_client::{Replica, ReplicaOptions, ReplicaStatus};
use mrol_map::map::MapName;

/// A replica with a connection of its own, and what it saw since somebody asked.
pub(crate) struct Spectator {
    replica: Replica,
    seen: Arc<Mutex<Vec<Sighting>>>,
    noting: JoinHandle<()>,
}

impl Spectator {
    pub(crate) async fn open(server: &GrpcAddress, map: &MapName) -> Result<Self, FleetError> {
        let replica = Replica::open(server.connect().await?, map.clone(), ReplicaOptions::default()).await;
        let replica = replica.map_err(FleetError::failed)?;
        let (mut statuses, seen) = (replica.statuses(), Arc::new(Mutex::new(Vec::new())));
        let noted = Arc::clone(&seen);
        let noting = tokio::spawn(async move {
            let mut last = 0;
            while statuses.changed().await.is_ok() {
                let version = statuses.borrow_and_update().version;
                if version.revision != last {
                    let at = Instant::now();
                    noted.lock().push(Sighting { revision: version.revision, hash: version.hash, at });
                    last = version.revision;
                }
            }
        });
        Ok(Self { replica, seen, noting })
    }

    /// What was seen since the last call.
    pub(crate) fn take_seen(&self) -> Vec<Sighting> {
        std::mem::take(&mut self.seen.lock())
    }

    pub(crate) fn status(&self) -> ReplicaStatus {
        self.replica.status()
    }

    /// Waits until the replica has a revision, and the server tells it of more.
    pub(crate) async fn wait_for(&self, revision: u64, wait_max: Duration) -> Result<(), FleetError> {
        let mut statuses = self.replica.statuses();
        let there = statuses.wait_for(|status| status.is_connected && status.version.revision >= revision);
        match tokio::time::timeout(wait_max, there).await {
            Ok(Ok(_)) => Ok(()),
            _ => {
                let status = self.status();
                Err(FleetError::failed(format!("a replica does not come to revision {revision}: {status:?}")))
            }
        }
    }
}

impl Drop for Spectator {
    fn drop(&mut self) {
        self.noting.abort();
    }
}
