//! The connections of this process to servers, by their numbers.

use std::collections::BTreeMap;
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use mrol_client::{Client, ClientError, Credentials};
use parking_lot::RwLock;
use tokio::runtime::Runtime;

use crate::failure::Failure;
use crate::process;
use crate::replicas::REPLICAS;

/// The connections of this process.
pub(crate) static CLIENTS: Clients =
    Clients { last_number: AtomicU64::new(0), open: RwLock::new(BTreeMap::new()) };

/// `mrol_client`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
pub struct ClientHandle {
    pub(crate) number: u64,
}

impl ClientHandle {
    /// No connection.
    pub(crate) const NONE: Self = Self { number: 0 };
}

/// Connections by their numbers: one that was closed is an error for ever.
pub(crate) struct Clients {
    last_number: AtomicU64,
    open: RwLock<BTreeMap<ClientHandle, Arc<OpenClient>>>,
}

/// A connection, with what it runs on.
pub(crate) struct OpenClient {
    client: Client,
    timeout: Duration,
    /// The last field, so that its threads are there while the connection is dropped.
    runtime: Arc<Runtime>,
}

impl Clients {
    /// Connects to a server.
    pub(crate) fn open(
        &self,
        address: &str,
        credentials: &Credentials,
        timeout: Duration,
    ) -> Result<ClientHandle, Failure> {
        process::claim()?;
        let runtime = REPLICAS.runtime()?;
        let connected = runtime.block_on(async {
            tokio::time::timeout(timeout, Client::connect_with(address, credentials)).await
        });
        let client = connected.map_err(|_| Failure::no_answer(timeout))??.with_timeout(timeout);
        let handle = ClientHandle { number: self.last_number.fetch_add(1, Ordering::Relaxed) + 1 };
        self.open.write().insert(handle, Arc::new(OpenClient { client, timeout, runtime }));
        Ok(handle)
    }

    /// The connection of a number.
    pub(crate) fn get(&self, client: ClientHandle) -> Result<Arc<OpenClient>, Failure> {
        process::check()?;
        self.open.read().get(&client).cloned().ok_or_else(Failure::client_closed)
    }

    /// Closes a connection. It ends when the last call that uses it returns.
    pub(crate) fn close(&self, client: ClientHandle) -> Result<(), Failure> {
        process::check()?;
        self.open.write().remove(&client).map(drop).ok_or_else(Failure::client_closed)
    }
}

impl OpenClient {
    /// What a call answers, within the time of the connection's calls.
    pub(crate) fn call<'a, T, F>(&'a self, call: impl FnOnce(&'a Client) -> F) -> Result<T, Failure>
    where
        F: Future<Output = Result<T, ClientError>>,
    {
        let call = async { tokio::time::timeout(self.timeout, call(&self.client)).await };
        let answered = self.runtime.block_on(call);
        Ok(answered.map_err(|_| Failure::no_answer(self.timeout))??)
    }
}
