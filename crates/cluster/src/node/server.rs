//! A node of the cluster.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc as std_mpsc;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mrol_map::util::Durations;
use mrol_service::replication::NodeName;
use mrol_service::{Cluster, Forward, Lead, MapService};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio::task;
use uuid::Uuid;

use super::blocking::blocking;
use super::entering::Entering;
use super::heart::{Heart, Pulse};
use super::keepers::{Keepers, Wish};
use super::lag::Lag;
use super::settings::NodeSettings;
use super::view::View;
use crate::beat::MapHead;
use crate::catalog::Listing;
use crate::engine::ConnectError;
use crate::forwarder::Forwarder;
use crate::store::{ClusterStore, NoStore};

/// How long NATS may tell a node nothing of the others before it counts as behind. An election of NATS takes some
/// seconds, in which all nodes see nothing, and all go on answering.
const SIGHT_LOST: Duration = Duration::from_secs(30);
/// Pause before NATS is tried again.
const CONNECT_AGAIN: Duration = Duration::from_secs(1);
/// A node of the cluster: a server that shares its maps with others. It is made before the server's maps are opened,
/// whose operations enter maps by it, and begins to work with [`Node::begin`].
pub struct Node {
    settings: NodeSettings,
    forwarder: Arc<Forwarder>,
    joined: Arc<OnceLock<ClusterStore>>,
    view: watch::Sender<View>,
    /// The maps of the cluster, as far as it has read.
    list: watch::Sender<Listing>,
    /// Whether it is where the others are.
    lag: Arc<Mutex<Lag>>,
    takeovers: Arc<AtomicU64>,
    wishes: mpsc::UnboundedSender<Wish>,
    heard: Mutex<Option<mpsc::UnboundedReceiver<Wish>>>,
    work: Mutex<Option<task::JoinHandle<()>>>,
    heart: Mutex<Option<(std_mpsc::Sender<Pulse>, JoinHandle<()>)>>,
}

/// What a node knows of the cluster.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeStatus {
    /// True once NATS has acknowledged a beat of this node.
    pub is_joined: bool,
    /// The gRPC addresses of the other nodes, those that are gone among them.
    pub grpc: BTreeMap<NodeName, String>,
    /// The nodes that are gone.
    pub gone: Vec<NodeName>,
    /// How long ago NATS acknowledged the last beat of this node and gave those of the others; none before the first.
    pub seen: Option<Duration>,
    /// The furthest revision of each map at the other nodes that are live and take changes of it.
    pub furthest: BTreeMap<Uuid, u64>,
    /// How often this node took a map over.
    pub takeovers: u64,
    /// How long its messages to the maps' logs took until NATS acknowledged them.
    pub acknowledgments: Durations,
}

impl Node {
    /// How long a node that leaves may take to hand over its maps, all in all.
    pub const LEAVING_MAX: Duration = Duration::from_secs(5);

    /// A node that does nothing yet, and asks others by `forwarder`.
    pub fn new(settings: NodeSettings, forwarder: Forwarder) -> Arc<Self> {
        let (wishes, heard) = mpsc::unbounded_channel();
        Arc::new(Self {
            settings,
            forwarder: Arc::new(forwarder),
            joined: Arc::default(),
            view: watch::Sender::new(View::default()),
            list: watch::Sender::new(Listing::default()),
            lag: Arc::default(),
            takeovers: Arc::default(),
            wishes,
            heard: Mutex::new(Some(heard)),
            work: Mutex::new(None),
            heart: Mutex::new(None),
        })
    }

    /// Its part in the operations of the service.
    pub fn cluster(&self) -> Cluster {
        Cluster {
            node: self.settings.name.clone(),
            forward: Arc::clone(&self.forwarder) as Arc<dyn Forward>,
            catalog: Arc::new(Entering::new(
                &self.settings,
                Arc::clone(&self.joined),
                self.wishes.clone(),
                self.view.subscribe(),
                self.list.subscribe(),
            )),
        }
    }

    /// Begins to work, once the maps of `service` are open: waits for NATS, for as long as that takes.
    pub fn begin(self: &Arc<Self>, service: MapService) {
        let this = Arc::clone(self);
        *self.work.lock() = Some(tokio::spawn(async move { this.work(service).await }));
    }

    async fn work(self: Arc<Self>, service: MapService) {
        let joined = self.join().await;
        let Some(heard) = self.heard.lock().take() else { return };
        drop(self.joined.set(joined.clone()));
        let (pulse, pulses) = std_mpsc::channel();
        let heart = Heart {
            settings: self.settings.clone(),
            joined: joined.clone(),
            service: service.clone(),
            forwarder: Arc::clone(&self.forwarder),
            view: self.view.clone(),
            list: self.list.subscribe(),
            lag: Arc::clone(&self.lag),
        };
        match std::thread::Builder::new().name("beats".to_owned()).spawn(move || heart.beat(&pulses)) {
            Ok(thread) => *self.heart.lock() = Some((pulse.clone(), thread)),
            Err(error) => {
                return tracing::error!(%error, "no thread for the node's beats: it takes no part in the cluster");
            }
        }
        let (view, takeovers) = (self.view.subscribe(), Arc::clone(&self.takeovers));
        let keepers =
            Keepers::new(&self.settings, service, joined, view, pulse, self.list.clone(), takeovers);
        keepers.keep(heard).await;
    }

    /// Connects, again and again. What is wrong in the settings is said each time.
    async fn join(&self) -> ClusterStore {
        let mut last_said = String::new();
        loop {
            let settings = self.settings.engine.clone();
            let error = match blocking(move || ClusterStore::create(&settings)).await {
                Ok(joined) => return joined,
                Err(error) => error,
            };
            let (is_patient, said) = (is_patient(&error), error.to_string());
            if said != last_said {
                match is_patient {
                    true => tracing::warn!(why = said, "waits for NATS: maps take no changes before"),
                    false => {
                        tracing::error!(why = said, "cannot join the cluster: maps take no changes before")
                    }
                }
                last_said = said;
            }
            tokio::time::sleep(CONNECT_AGAIN).await;
        }
    }

    /// What it knows of the cluster.
    pub fn status(&self) -> NodeStatus {
        let view = self.view.borrow();
        let others = view.others.iter();
        NodeStatus {
            is_joined: view.beats > 0,
            grpc: others.clone().map(|(node, seen)| (node.clone(), seen.beat.grpc.clone())).collect(),
            gone: others.filter(|(_, seen)| !seen.is_live).map(|(node, _)| node.clone()).collect(),
            seen: view.seen.map(|seen| seen.elapsed()),
            furthest: view.furthest(),
            takeovers: self.takeovers.load(Ordering::Relaxed),
            acknowledgments: self
                .joined
                .get()
                .map(|joined| joined.engine.acknowledgments())
                .unwrap_or_default(),
        }
    }

    /// True before it has joined the cluster and was where the others are, where a copy is behind theirs, or lacking,
    /// for so long, and where NATS has told nothing of the others for half a minute: then it cannot know.
    pub fn is_behind(&self, lag_max: Duration) -> bool {
        let lag = *self.lag.lock();
        let sees = self.view.borrow().seen.is_some_and(|seen| seen.elapsed() < SIGHT_LOST);
        !sees || lag.is_over(lag_max)
    }

    /// Hands the maps that it leads over to others, in some seconds at most: they take over when they have read that.
    /// What is asked of this node until it ends goes on to them.
    pub async fn leave(&self, service: &MapService) {
        let until = Instant::now() + Self::LEAVING_MAX;
        let led = |service: &MapService| {
            let maps = service.shared_maps().into_iter();
            maps.filter(|map| matches!(map.lead, Lead::Shared { is_here: true, .. })).collect::<Vec<_>>()
        };
        let mut handed = Vec::new();
        for map in led(service) {
            let view = self.view.borrow().clone();
            let wanted = self.list.borrow().holders_of(map.version.map_uuid);
            // Those of an older version read less than a newer one would write. One that is about to drop its copy
            // leads where no holder has one.
            let version = |node: &NodeName| view.others[node].beat.record_version;
            let first = |(node, head): &(&NodeName, &MapHead)| {
                (wanted.contains(node), std::cmp::Reverse(version(node)), head.sequence)
            };
            let copies = view.holders(map.version.map_uuid);
            let Some((node, _)) = copies.max_by_key(first) else { continue };
            let over = service.hand_map_over(&map.name, node.clone());
            match tokio::time::timeout(until.saturating_duration_since(Instant::now()), over).await {
                Ok(Ok(_)) => handed.push(map.name),
                Ok(Err(error)) => tracing::warn!(map = %map.name, %error, "was not handed over"),
                Err(_) => break,
            }
        }
        if !handed.is_empty() {
            tracing::info!(maps = handed.len(), "handed over");
        }
    }

    /// Ends its work.
    pub async fn end(&self) {
        let work = self.work.lock().take();
        work.inspect(task::JoinHandle::abort);
        let heart = self.heart.lock().take();
        if let Some((pulse, thread)) = heart {
            _ = pulse.send(Pulse::End);
            // It may wait for NATS.
            drop(tokio::time::timeout(CONNECT_AGAIN, task::spawn_blocking(|| thread.join())).await);
        }
    }
}

/// True where waiting helps.
fn is_patient(error: &NoStore) -> bool {
    match error {
        NoStore::Connect(error) => {
            matches!(error, ConnectError::NoServer { .. } | ConnectError::NoQuorum { .. })
        }
        NoStore::Stream(_) => true,
    }
}

impl fmt::Debug for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Node").field(&self.settings.name).finish()
    }
}
