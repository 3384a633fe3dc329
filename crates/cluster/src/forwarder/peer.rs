//! The connection to another node.

use std::time::{Duration, Instant};

use mrol_client::{ClientError, Credentials, NodeClient};
use mrol_map::sync::{Mutex, Rank};
use mrol_service::replication::NodeName;

/// Another node: where it is, and the connection to it.
#[derive(Debug)]
pub(super) struct Peer {
    /// Address of its gRPC listener.
    pub(super) address: String,
    connected: Mutex<Option<NodeClient>>,
    /// Held while a connection is made, with when making the last one failed, and why.
    connecting: tokio::sync::Mutex<Option<(Instant, ClientError)>>,
}

impl Peer {
    pub(super) fn at(address: String) -> Self {
        Self {
            address,
            connected: Mutex::new(Rank::Brief, None),
            connecting: tokio::sync::Mutex::const_new(None),
        }
    }

    /// The connection, which is made where there is none or the last one was lost. Of calls that wait for one, the
    /// first makes it for all; where it cannot, all hear of it, and none waits longer than `timeout`.
    ///
    /// # Errors
    /// When the node does not answer, or the two do not trust each other.
    pub(super) async fn client(
        &self,
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
        let connected = NodeClient::connect(&self.address, credentials, own.clone(), timeout).await;
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
