//! One connection to another node, and the places on it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use mrol_client::{ClientError, ConnectionUse, Credentials, NodeClient};
use mrol_map::sync::{Mutex, Rank};
use mrol_service::replication::NodeName;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Calls on a connection at once. A server takes 128: one more would wait there for the end of another, and nobody
/// could tell whether it was sent.
pub(super) const CALLS_MAX: usize = 100;

/// One connection to another node, which is made when it is first needed and again once it is lost.
#[derive(Debug)]
pub(super) struct Line {
    usage: ConnectionUse,
    places: Arc<Semaphore>,
    connected: Mutex<Option<NodeClient>>,
    /// Held while a connection is made, with when making the last one failed, and why.
    connecting: tokio::sync::Mutex<Option<(Instant, ClientError)>>,
}

/// A place on a connection, for as long as a call takes.
pub(super) type Place = OwnedSemaphorePermit;

impl Line {
    pub(super) fn of(usage: ConnectionUse) -> Self {
        Self {
            usage,
            places: Arc::new(Semaphore::new(CALLS_MAX)),
            connected: Mutex::new(Rank::Brief, None),
            connecting: tokio::sync::Mutex::const_new(None),
        }
    }

    /// A place that is free now.
    pub(super) fn free_place(&self) -> Option<Place> {
        Arc::clone(&self.places).try_acquire_owned().ok()
    }

    /// A place that is free within so long.
    pub(super) async fn place(&self, within: Duration) -> Option<Place> {
        let place = Arc::clone(&self.places).acquire_owned();
        tokio::time::timeout(within, place).await.ok()?.ok()
    }

    /// True where nobody has a place.
    pub(super) fn is_unused(&self) -> bool {
        self.places.available_permits() == CALLS_MAX
    }

    /// The connection to `address`, which is made where there is none or the last one was lost. Of calls that wait for
    /// one, the first makes it for all; where it cannot, all hear of it, and none waits longer than `timeout`.
    ///
    /// # Errors
    /// When the node does not answer, or the two do not trust each other.
    pub(super) async fn client(
        &self,
        address: &str,
        credentials: &Credentials,
        own: &NodeName,
        timeout: Duration,
    ) -> Result<NodeClient, ClientError> {
        if let Some(client) = self.connected() {
            return Ok(client);
        }
        let asked = Instant::now();
        let mut failed = self.connecting.lock().await;
        if let Some(client) = self.connected() {
            return Ok(client);
        }
        match &*failed {
            Some((at, error)) if *at >= asked => return Err(error.clone()),
            _ => {}
        }
        let connected = NodeClient::connect(address, credentials, own.clone(), self.usage, timeout).await;
        match &connected {
            Ok(client) => *self.connected.lock() = Some(client.clone()),
            Err(error) => *failed = Some((Instant::now(), error.clone())),
        }
        connected
    }

    fn connected(&self) -> Option<NodeClient> {
        self.connected.lock().clone().filter(|client| !client.is_gone())
    }
}
