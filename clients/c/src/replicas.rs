//! The open replicas of this process, by their numbers, and the threads that they share.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;

use mrol_client::planning::clearance_max_m;
use mrol_client::service::{AtVersion, PointAnswer, PointQuery, Question};
use mrol_client::{Client, Replica};
use parking_lot::{Mutex, RwLock};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;

use crate::abi::{ReplicaHandle, Status};
use crate::failure::Failure;
use crate::options::Opening;
use crate::process;

/// Threads that apply changes, at most.
const APPLYING_THREADS: usize = 2;

/// The open replicas of this process.
pub(crate) static REPLICAS: Replicas = Replicas {
    last_number: AtomicU64::new(0),
    open: RwLock::new(BTreeMap::new()),
    runtime: Mutex::new(Weak::new()),
};

/// Open replicas by their numbers. A program that uses a number after its end finds nothing, where a pointer would be
/// to memory that is somebody else's.
pub(crate) struct Replicas {
    last_number: AtomicU64,
    open: RwLock<BTreeMap<ReplicaHandle, Arc<OpenReplica>>>,
    /// The threads of all replicas, for as long as there is one.
    runtime: Mutex<Weak<Runtime>>,
}

/// A replica, with what it runs on.
pub(crate) struct OpenReplica {
    replica: Replica,
    is_whole: bool,
    /// Wakes all waiters: the replica is closed.
    closed: watch::Sender<bool>,
    /// The last field, so that its threads are there while the replica is dropped.
    runtime: Arc<Runtime>,
}

impl Replicas {
    /// Opens a replica.
    pub(crate) fn open(&self, opening: Opening) -> Result<ReplicaHandle, Failure> {
        process::claim()?;
        let opened = Arc::new(OpenReplica::open(opening, self.runtime()?)?);
        let replica = ReplicaHandle { number: self.last_number.fetch_add(1, Ordering::Relaxed) + 1 };
        self.open.write().insert(replica, opened);
        Ok(replica)
    }

    /// The replica of a number.
    pub(crate) fn get(&self, replica: ReplicaHandle) -> Result<Arc<OpenReplica>, Failure> {
        process::check()?;
        self.open.read().get(&replica).cloned().ok_or_else(Failure::closed)
    }

    /// Closes a replica. It ends when the last call that uses it returns.
    pub(crate) fn close(&self, replica: ReplicaHandle) -> Result<(), Failure> {
        process::check()?;
        let open = self.open.write().remove(&replica).ok_or_else(Failure::closed)?;
        open.closed.send_replace(true);
        Ok(())
    }

    /// The threads: those that there are, or new ones.
    pub(crate) fn runtime(&self) -> Result<Arc<Runtime>, Failure> {
        let mut runtime = self.runtime.lock();
        if let Some(running) = runtime.upgrade() {
            return Ok(running);
        }
        let started = Builder::new_multi_thread()
            .worker_threads(1)
            .max_blocking_threads(APPLYING_THREADS)
            .thread_name("mrol-replica")
            .enable_all()
            .build();
        let started = Arc::new(started.map_err(|error| Failure::no_threads(&error))?);
        *runtime = Arc::downgrade(&started);
        Ok(started)
    }
}

impl OpenReplica {
    fn open(opening: Opening, runtime: Arc<Runtime>) -> Result<Self, Failure> {
        let Opening { address, map, credentials, replica: options, timeout } = opening;
        let opened = runtime.block_on(async {
            let copying = async {
                let client = Client::connect_with(&address, &credentials).await?;
                Replica::open(client, map, options).await.map_err(Failure::from)
            };
            tokio::time::timeout(timeout, copying).await
        });
        let replica = opened.map_err(|_| Failure::too_slow(timeout))??;
        let (is_whole, closed) = (options.region.is_none(), watch::Sender::new(false));
        Ok(Self { replica, is_whole, closed, runtime })
    }

    /// How far the replica is.
    pub(crate) fn status(&self) -> Status {
        Status::of(&self.replica.status(), self.replica.age(), self.is_whole)
    }

    /// Refuses a copy whose server was heard longer ago than `age_max`.
    pub(crate) fn check_age(&self, age_max: Duration) -> Result<(), Failure> {
        Ok(self.replica.check_age(age_max)?)
    }

    /// Waits for a revision, or for the replica's end.
    pub(crate) fn wait_for_revision(&self, revision: u64, timeout: Duration) -> Result<(), Failure> {
        let mut closed = self.closed.subscribe();
        self.runtime.block_on(async {
            tokio::select! {
                biased;
                reached = self.replica.wait_for_revision(revision, timeout) => Ok(reached?),
                _ = closed.wait_for(|closed| *closed) => Err(Failure::closed()),
            }
        })
    }

    /// Answers a question about points.
    pub(crate) fn query_points(&self, query: &PointQuery) -> Result<PointAnswer, Failure> {
        Ok(self.replica.query_points(query)?)
    }

    /// Up to where clearances can be told at `level`, meters; nothing of a level that is none, which questions refuse.
    pub(crate) fn clearance_max_m(&self, level: u32) -> f32 {
        let map = self.replica.map();
        let lattice = map.lattice();
        if level < lattice.levels() { clearance_max_m(lattice, level) } else { 0.0 }
    }

    /// Answers a question of a planner.
    pub(crate) fn ask<Q: Question>(&self, question: &Q) -> Result<AtVersion<Q::Answer>, Failure> {
        Ok(self.replica.ask(question)?)
    }
}
