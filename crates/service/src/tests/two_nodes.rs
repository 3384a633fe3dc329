//! Two nodes that share a map by a log in memory, and ask each other in this process.

use std::sync::{Arc, OnceLock};

use parking_lot::Mutex;
use tokio_stream::StreamExt;
use uuid::Uuid;

use crate::caller::{AllowedMaps, AllowedScans};
use crate::cluster::{Cluster, Forward, ForwardedCall, ForwardedEvents, Later, NewMap, SharedCatalog};
use crate::commit::Lead;
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::replication::{MemoryLog, NodeLog, NodeName};
use crate::request::{
    DeleteKeepOut, Deletion, DeletionAnswer, EventsQuery, KeepOutAnswer, MapElsewhere, PutKeepOut,
    ScanAnswer, ScanEvent, ScanRequest, Undo, UndoAnswer,
};
use crate::settings::ServiceSettings;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapName, MapSettings, RobotName};
use mrol_map::mapping::{Guess, Sighting};
use mrol_store::OpeningProgress;

/// Two nodes, `a` and `b`, with one map that both share and nobody leads yet.
pub(super) struct TwoNodes {
    pub(super) a: Node,
    pub(super) b: Node,
    pub(super) map: MapName,
    pub(super) log: NodeLog,
}

/// A node: its service, and how it asks the other.
pub(super) struct Node {
    pub(super) name: NodeName,
    pub(super) service: MapService,
    pub(super) other: Arc<Other>,
    _data_dir: tempfile::TempDir,
}

/// The other node, as one of them asks it.
#[derive(Debug, Default)]
pub(super) struct Other {
    service: OnceLock<MapService>,
    /// What every call fails with, in the place of asking.
    pub(super) fails_with: Mutex<Option<ServiceError>>,
    /// True of a node that never answers.
    pub(super) is_silent: Mutex<bool>,
    /// All calls, with what was asked.
    pub(super) calls: Mutex<Vec<(&'static str, ForwardedCall)>>,
}

#[derive(Debug)]
struct NoCatalog;

impl TwoNodes {
    pub(super) async fn begin() -> Self {
        let (a, b) = (Node::begin("a"), Node::begin("b"));
        a.other.service.set(b.service.clone()).unwrap();
        b.other.service.set(a.service.clone()).unwrap();
        let map = MapName::new("hall").unwrap();
        // A server by itself made it.
        let alone = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let (info, _) = alone.create_map(map.clone(), MapSettings::new(0.1, 3)).await.unwrap();
        let file = alone.snapshot_map(&map).await.unwrap().bytes;
        for node in [&a, &b] {
            node.service.copy_map(map.clone(), info.version.map_uuid, file.clone(), false).await.unwrap();
        }
        let log = NodeLog(Arc::new(Mutex::new(MemoryLog::new(1))));
        for node in [&a, &b] {
            let (log, name) = (Arc::new(log.clone()), node.name.clone());
            node.service.share_map(&map, log, name).await.unwrap();
        }
        Self { a, b, map, log }
    }

    /// The same, where `a` leads and `b` knows.
    pub(super) async fn led_by_a() -> Self {
        let nodes = Self::begin().await;
        nodes.a.lead(&nodes.map).await;
        nodes.b.service.follow_map(&nodes.map, None).await.unwrap();
        nodes
    }

    /// `a` gives the lead to `b`, which has not heard of it yet.
    pub(super) async fn hand_over(&self) {
        self.a.service.hand_map_over(&self.map, self.b.name.clone()).await.unwrap();
    }

    /// `b` takes over what it was given.
    pub(super) async fn take_over(&self) {
        self.b.service.follow_map(&self.map, None).await.unwrap();
        self.b.lead(&self.map).await;
    }
}

impl Node {
    /// Takes over: the other has nothing that this one has not.
    pub(super) async fn lead(&self, map: &MapName) {
        self.service.claim_map(map, None).await.unwrap();
        self.service.open_map(map, self.claim_of(map).await, Vec::new()).await.unwrap();
    }

    /// The last claim of a map that it has read.
    pub(super) async fn claim_of(&self, map: &MapName) -> Option<Uuid> {
        match &*self.service.lead_of(map).await.unwrap().borrow() {
            Lead::Shared { claim, .. } => *claim,
            _ => None,
        }
    }

    fn begin(name: &str) -> Self {
        let (name, other) = (NodeName::new(name).unwrap(), Arc::<Other>::default());
        let data_dir = tempfile::tempdir().unwrap();
        let settings = ServiceSettings {
            data_dir: Some(data_dir.path().to_owned()),
            cluster: Some(Cluster {
                node: name.clone(),
                forward: Arc::<Other>::clone(&other),
                catalog: Arc::new(NoCatalog),
            }),
            ..ServiceSettings::default()
        };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        Self { name, service, other, _data_dir: data_dir }
    }

    /// What was asked of the other node, in order.
    pub(super) fn asked(&self) -> Vec<&'static str> {
        self.other.calls.lock().iter().map(|(asked, _)| *asked).collect()
    }
}

/// A scan of one point at `x_m`, taken as it is.
pub(super) fn scan_of(robot: &str, x_m: f32) -> ScanRequest {
    let points = vec![Point::new(x_m, 0.05, 0.05)].into();
    let guess = Guess::Pose(Pose::identity());
    ScanRequest { guess, at_guess: true, ..ScanRequest::new(RobotName::new(robot).unwrap(), points) }
}

impl Other {
    /// Asks the other node as a server would, which was told the caller's name.
    fn ask<'a, A, Fut>(
        &'a self,
        asked: &'static str,
        call: &'a ForwardedCall,
        send: impl FnOnce(MapService) -> Fut + Send + 'a,
    ) -> Later<'a, Result<A, ServiceError>>
    where
        Fut: Future<Output = Result<A, ServiceError>> + Send + 'a,
        A: Send + 'a,
    {
        self.calls.lock().push((asked, call.clone()));
        let failure = self.fails_with.lock().clone();
        if *self.is_silent.lock() {
            return Box::pin(std::future::pending());
        }
        if let Some(error) = failure {
            return Box::pin(std::future::ready(Err(error)));
        }
        let service = self.service.get().unwrap();
        let caller = call.caller.clone();
        Box::pin(send(service.limited_to(caller, AllowedMaps::Every, AllowedScans::default()).forwarded()))
    }
}

impl Forward for Other {
    fn insert_scan<'a>(
        &'a self,
        call: &'a ForwardedCall,
        scan: ScanRequest,
    ) -> Later<'a, Result<ScanAnswer, ServiceError>> {
        self.ask("insert_scan", call, async move |to| to.insert_scan(&call.map, scan).await)
    }

    fn delete_voxels<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: Deletion,
    ) -> Later<'a, Result<DeletionAnswer, ServiceError>> {
        self.ask("delete_voxels", call, async move |to| to.delete_voxels(&call.map, deletion).await)
    }

    fn undo<'a>(
        &'a self,
        call: &'a ForwardedCall,
        undo: Undo,
    ) -> Later<'a, Result<UndoAnswer, ServiceError>> {
        self.ask("undo", call, async move |to| to.undo(&call.map, undo).await)
    }

    fn put_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        put: PutKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>> {
        self.ask("put_keep_out", call, async move |to| to.put_keep_out(&call.map, put).await)
    }

    fn delete_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: DeleteKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>> {
        self.ask("delete_keep_out", call, async move |to| to.delete_keep_out(&call.map, deletion).await)
    }

    fn list_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<Vec<Arc<ScanEvent>>, ServiceError>> {
        self.ask("list_events", call, async move |to| to.list_events(&call.map, query).await)
    }

    fn watch_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<ForwardedEvents, ServiceError>> {
        self.ask("watch_events", call, async move |to| {
            let watch = to.watch_events(&call.map, query).await?;
            let events: ForwardedEvents = Box::pin(watch.into_stream(std::future::pending()).fuse());
            Ok(events)
        })
    }

    fn sightings<'a>(&'a self, call: &'a ForwardedCall) -> Later<'a, Result<Vec<Sighting>, ServiceError>> {
        self.ask("sightings", call, async move |to| Ok(to.map_info(&call.map).await?.sightings))
    }
}

impl SharedCatalog for NoCatalog {
    fn enter<'a>(&'a self, _: &'a MapName, _: NewMap) -> Later<'a, Result<bool, ServiceError>> {
        none()
    }

    fn look_for<'a>(&'a self, _: &'a MapName) -> Later<'a, Result<bool, ServiceError>> {
        Box::pin(std::future::ready(Ok(false)))
    }

    fn held_elsewhere(&self) -> Vec<MapElsewhere> {
        Vec::new()
    }

    fn delete<'a>(&'a self, _: &'a MapName, _: Uuid) -> Later<'a, Result<(), ServiceError>> {
        none()
    }
}

fn none<'a, A: Send + 'a>() -> Later<'a, Result<A, ServiceError>> {
    Box::pin(std::future::ready(Err(ServiceError::new(Reason::NoQuorum, "there is no catalog here"))))
}
