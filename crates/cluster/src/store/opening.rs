//! The connection to NATS, with all that the nodes keep there.

use crate::bases::{BasePointers, BaseStore};
use crate::beats::Beats;
use crate::catalog::Catalog;
use crate::engine::{ConnectError, Engine, EngineSettings, StreamError};

/// The streams that every cluster has, besides the logs of its maps.
pub(super) const STREAMS: [&str; 4] = ["KV_mrol-beats", "KV_mrol-catalog", "KV_mrol-maps", "OBJ_mrol-bases"];

/// The connection to NATS, with all that the nodes of a cluster keep there. Clones share it.
#[derive(Debug, Clone)]
pub struct ClusterStore {
    /// The connection.
    pub engine: Engine,
    /// What each node says of itself.
    pub beats: Beats,
    /// The list of maps.
    pub catalog: Catalog,
    /// The files of bases.
    pub bases: BaseStore,
    /// Which file is the base of each map.
    pub pointers: BasePointers,
}

/// Why there is no [`ClusterStore`].
#[derive(Debug, thiserror::Error)]
pub enum NoStore {
    /// There is no connection.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// NATS has no stream, or does not make one.
    #[error(transparent)]
    Stream(#[from] StreamError),
}

impl ClusterStore {
    /// Connects, and makes what is not there yet. Waits for some seconds; not for an async thread.
    ///
    /// # Errors
    /// Says what to do, or what NATS said.
    pub fn create(settings: &EngineSettings) -> Result<Self, NoStore> {
        Ok(Self::on(Engine::connect(settings)?)?)
    }

    /// Connects to what the nodes of a cluster have made, likewise, and makes nothing.
    ///
    /// # Errors
    /// [`StreamError::Missing`] where there was no node yet; else as for [`ClusterStore::create`].
    pub fn find(settings: &EngineSettings) -> Result<Self, NoStore> {
        let engine = Engine::connect(settings)?;
        for stream in STREAMS {
            engine.block_on(engine.find_stream(stream))?;
        }
        Ok(Self::on(engine)?)
    }

    fn on(engine: Engine) -> Result<Self, StreamError> {
        Ok(Self {
            beats: Beats::create(&engine)?,
            catalog: Catalog::create(&engine)?,
            bases: BaseStore::create(&engine)?,
            pointers: BasePointers::create(&engine)?,
            engine,
        })
    }
}
