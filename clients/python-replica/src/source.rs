//! Whichever is asked: a copy of a server's map, or a map of this process.

use std::process;
use std::sync::{Arc, RwLock};

use mrol_client::Replica;
use mrol_client::map::MapName;
use mrol_client::service::{AtVersion, MapService, PointAnswer, PointQuery, Question};
use pyo3::prelude::*;

use crate::failure::Failure;
use crate::waiting::{threads, wait_for};

/// A map that answers in this process.
pub(crate) enum Source {
    /// A copy of a server's.
    Replica(Replica),
    /// One without a server: that which a server would have, alone in a service of its own.
    Local {
        /// The service.
        service: MapService,
        /// The name of its map.
        name: MapName,
    },
}

/// A source that can be closed, and stays with its process.
pub(crate) struct OpenSource {
    owner: u32,
    source: RwLock<Option<Arc<Source>>>,
}

impl OpenSource {
    pub(crate) fn new(source: Source) -> Self {
        Self { owner: process::id(), source: RwLock::new(Some(Arc::new(source))) }
    }

    /// The source, while it is open.
    pub(crate) fn get(&self) -> Result<Arc<Source>, Failure> {
        if self.owner != process::id() {
            return Err(Failure::forked());
        }
        let source = self.source.read().unwrap_or_else(|poisoned| poisoned.into_inner());
        source.clone().ok_or_else(Failure::closed)
    }

    /// Closes it, once the last call that uses it returns.
    pub(crate) fn close(&self) {
        let closed = self.source.write().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if self.owner != process::id() {
            // A child has no thread that would end its work.
            std::mem::forget(closed);
        }
    }
}

impl Drop for OpenSource {
    fn drop(&mut self) {
        self.close();
    }
}

impl Source {
    /// Answers a question of a planner, while other threads of Python go on.
    pub(crate) fn ask<Q: Question>(&self, py: Python<'_>, question: Q) -> PyResult<AtVersion<Q::Answer>> {
        match self {
            Self::Replica(replica) => Ok(py.detach(|| replica.ask(&question)).map_err(Failure::from)?),
            Self::Local { service, name } => wait_for(py, service.ask(name, question)),
        }
    }

    /// Answers a question about points.
    pub(crate) fn query_points(&self, py: Python<'_>, query: PointQuery) -> PyResult<PointAnswer> {
        match self {
            Self::Replica(replica) => {
                Ok(py.detach(|| replica.query_points(&query)).map_err(Failure::from)?)
            }
            Self::Local { service, name } => wait_for(py, service.query_points(name, query)),
        }
    }

    /// The replica, where it is one.
    pub(crate) fn replica(&self) -> Result<&Replica, Failure> {
        match self {
            Self::Replica(replica) => Ok(replica),
            Self::Local { .. } => Err(Failure::argument("it is no replica")),
        }
    }

    /// The service of a map without a server, and its name there.
    pub(crate) fn local(&self) -> Result<(&MapService, &MapName), Failure> {
        match self {
            Self::Local { service, name } => Ok((service, name)),
            Self::Replica(_) => Err(Failure::argument("it is no map of this process")),
        }
    }
}

/// Drops what is left of a source where its tasks run.
impl Drop for Source {
    fn drop(&mut self) {
        // The last reference may be dropped by any thread: none of them is one of the runtime.
        let _threads = threads().ok().map(tokio::runtime::Runtime::enter);
    }
}
