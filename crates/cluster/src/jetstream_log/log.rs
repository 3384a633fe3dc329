//! The log of a map as a stream of JetStream.

use mrol_service::replication::{Base, Entry, LogError, Message, NotPublished, Position, ReplicatedLog};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use uuid::Uuid;

use super::names::LogNames;
use super::news::{self, News};
use super::publish;
use super::read;
use super::stream::config_of;
use crate::bases::BasePointers;
use crate::engine::{Engine, StreamError, StreamState};

/// The log of a map, in the stream `mrol-UUID`.
#[derive(Debug)]
pub struct JetStreamLog {
    engine: Engine,
    map: Uuid,
    names: LogNames,
    bases: BasePointers,
    newest: watch::Receiver<u64>,
    listener: JoinHandle<()>,
}

impl JetStreamLog {
    /// The log of a map, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine, map: Uuid) -> Result<Self, StreamError> {
        let names = LogNames::of(map);
        engine.block_on(engine.create_stream(&config_of(&names, engine.replicas())))?;
        Self::of(engine, map, names)
    }

    /// The log of a map.
    ///
    /// # Errors
    /// [`StreamError::Missing`] where there is none, or what NATS said.
    pub fn open(engine: &Engine, map: Uuid) -> Result<Self, StreamError> {
        let names = LogNames::of(map);
        engine.block_on(engine.find_stream(&names.stream))?;
        Self::of(engine, map, names)
    }

    /// The name of the stream of a map's log.
    pub fn stream_of(map: Uuid) -> String {
        LogNames::of(map).stream
    }

    /// Deletes the log of a map, if there is one.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn delete(engine: &Engine, map: Uuid) -> Result<(), StreamError> {
        engine.block_on(engine.delete_stream(&LogNames::of(map).stream))
    }

    /// Deletes what is before a message, which itself stays: nobody may publish behind one that is not there.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn cut_before(&self, sequence: u64) -> Result<(), StreamError> {
        self.engine.block_on(self.engine.cut_stream(&self.names.stream, sequence))
    }

    /// What NATS keeps of the log.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn used(&self) -> Result<StreamState, StreamError> {
        self.engine.block_on(self.engine.stream_state(&self.names.stream))
    }

    /// The connection.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What wakes whoever waits for more.
    pub fn on_news(&self) -> News {
        News::of(&self.engine, &self.newest)
    }

    fn of(engine: &Engine, map: Uuid, names: LogNames) -> Result<Self, StreamError> {
        let bases = BasePointers::create(engine)?;
        let (sender, newest) = watch::channel(0);
        let listener = engine.spawn(news::listen(engine.client().clone(), names.clone(), sender));
        Ok(Self { engine: engine.clone(), map, names, bases, newest, listener })
    }
}

impl ReplicatedLog for JetStreamLog {
    fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished> {
        self.engine.block_on(publish::publish(&self.engine, &self.names, message, position))
    }

    fn base(&self) -> Result<Base, LogError> {
        let base = self.bases.read(self.map).map_err(|error| LogError::Unavailable(error.to_string()))?;
        Ok(base.map_or_else(Base::default, |(base, _)| base))
    }

    fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
        self.engine.block_on(read::read_behind(&self.engine, &self.names, position))
    }
}

impl Drop for JetStreamLog {
    fn drop(&mut self) {
        self.listener.abort();
    }
}
