//! The connection to NATS.

use std::fmt;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use async_nats::Client;
use async_nats::connection::State;
use mrol_map::util::{Durations, SharedDurations};
use tokio::runtime::{Handle, Runtime};
use tokio::task::JoinHandle;

use super::settings::EngineSettings;

/// The connection of a node to NATS, with a thread of its own: a busy server does not delay its pings. Clones share
/// it; it ends with the last.
///
/// It is made again by itself, for as long as it takes. What is asked meanwhile ends with its deadline.
#[derive(Clone)]
pub struct Engine(Arc<Connection>);

struct Connection {
    client: Client,
    replicas: usize,
    servers: String,
    acknowledgments: SharedDurations,
    handle: Handle,
    /// Taken at the end, which does not wait for what still runs.
    runtime: Option<Runtime>,
}

impl Engine {
    /// Of a runtime that has a connection.
    pub(super) fn of(client: Client, settings: &EngineSettings, runtime: Runtime) -> Self {
        let (replicas, servers) = (settings.replicas, settings.servers());
        let (acknowledgments, handle) = (SharedDurations::default(), runtime.handle().clone());
        let runtime = Some(runtime);
        Self(Arc::new(Connection { client, replicas, servers, acknowledgments, handle, runtime }))
    }

    /// True while a server is connected.
    pub fn is_connected(&self) -> bool {
        self.0.client.connection_state() == State::Connected
    }

    /// The addresses that were given, without passwords.
    pub fn servers(&self) -> &str {
        &self.0.servers
    }

    /// How long messages of the maps' logs took until NATS acknowledged them.
    pub fn acknowledgments(&self) -> Durations {
        self.0.acknowledgments.read()
    }

    /// Notes how long a message of a log took.
    pub(crate) fn note_acknowledgment(&self, took: Duration) {
        self.0.acknowledgments.record(took);
    }

    /// Version of the server that is connected.
    pub fn server_version(&self) -> String {
        self.0.client.server_info().version
    }

    /// Bytes of the largest message that the server takes.
    pub fn max_payload(&self) -> usize {
        self.0.client.server_info().max_payload
    }

    /// Waits for what needs the connection. Not for an async thread, on which it panics.
    pub(crate) fn block_on<F: Future>(&self, future: F) -> F::Output {
        self.0.handle.block_on(future)
    }

    /// Begins what runs beside.
    pub(crate) fn spawn(&self, future: impl Future<Output = ()> + Send + 'static) -> JoinHandle<()> {
        self.0.handle.spawn(future)
    }

    /// The connection as its library has it.
    pub(crate) fn client(&self) -> &Client {
        &self.0.client
    }

    /// On how many servers each stream is kept.
    pub(crate) fn replicas(&self) -> usize {
        self.0.replicas
    }
}

impl fmt::Debug for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Engine").field(&self.0.servers).finish()
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
