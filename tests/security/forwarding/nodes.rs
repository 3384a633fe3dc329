//! Two nodes, each behind its gRPC port.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http2;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo};
use mrol::access::{Access, Gate, Secret};
use mrol::admission::{Admission, Lifecycle};
use mrol::client::{Client, ConnectionUse, Credentials, NodeClient};
use mrol::map::{CallerName, MapName, MapSettings};
use mrol::middleware::Middleware;
use mrol::service::replication::NodeName;
use mrol::service::{
    Cluster, Later, Lead, Limits, MapElsewhere, MapService, NewMap, Reason, ServiceError, ServiceSettings,
    SharedCatalog,
};
use mrol::store::OpeningProgress;
use mrol::telemetry::{Audit, Metrics, RequestRecorder};
use mrol_cluster::{Forwarder, ForwarderSettings};
use tempfile::TempDir;
use tokio::net::TcpListener;
use tower::ServiceExt;
use uuid::Uuid;

use super::log::SharedLog;

const MESSAGE_BYTES_MAX: usize = 1 << 20;
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(10);

/// Two nodes that share a map, of which `a` leads.
pub(super) struct Nodes {
    pub(super) a: Node,
    pub(super) b: Node,
    pub(super) map: MapName,
}

/// A node that serves gRPC.
pub(super) struct Node {
    pub(super) name: NodeName,
    pub(super) service: MapService,
    grpc: SocketAddr,
    forwarder: Arc<Forwarder>,
    _data_dir: TempDir,
}

#[derive(Debug)]
struct NoCatalog;

impl Nodes {
    /// Let in by the rules `access`, the first of which are those of `a`; `secret` is what they show each other.
    pub(super) async fn start(access: [Access; 2], secret: Option<&Secret>) -> Self {
        let [of_a, of_b] = access;
        let (a, b) = (Node::start("a", of_a, secret).await, Node::start("b", of_b, secret).await);
        for (node, other) in [(&a, &b), (&b, &a)] {
            let address = format!("http://{}", other.grpc);
            node.forwarder.set_addresses([(other.name.clone(), address)].into());
        }
        let map = MapName::new("hall").unwrap();
        // A server by itself made it.
        let alone = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let (info, _) = alone.create_map(map.clone(), MapSettings::new(0.1, 3)).await.unwrap();
        let file = alone.snapshot_map(&map).await.unwrap().bytes;
        for node in [&a, &b] {
            node.service.copy_map(map.clone(), info.version.map_uuid, file.clone(), false).await.unwrap();
        }
        let log = SharedLog::default();
        for node in [&a, &b] {
            node.service.share_map(&map, Arc::new(log.clone()), node.name.clone()).await.unwrap();
        }
        a.service.claim_map(&map, None).await.unwrap();
        a.service.open_map(&map, claim_of(&a.service, &map).await, Vec::new()).await.unwrap();
        b.service.follow_map(&map, None).await.unwrap();
        Self { a, b, map }
    }

    /// `a` gives the lead to `b`, which takes over.
    pub(super) async fn hand_over(&self) {
        self.a.service.hand_map_over(&self.map, self.b.name.clone()).await.unwrap();
        self.b.service.follow_map(&self.map, None).await.unwrap();
        self.b.service.claim_map(&self.map, None).await.unwrap();
        self.b
            .service
            .open_map(&self.map, claim_of(&self.b.service, &self.map).await, Vec::new())
            .await
            .unwrap();
    }
}

impl Node {
    async fn start(name: &str, access: Access, secret: Option<&Secret>) -> Self {
        let (name, data_dir) = (NodeName::new(name).unwrap(), tempfile::tempdir().unwrap());
        let settings = ForwarderSettings {
            secret: secret.map(|secret| secret.reveal().to_owned()),
            ..ForwarderSettings::new(name.clone())
        };
        let forwarder = Arc::new(Forwarder::new(settings).unwrap());
        let forward = Arc::<Forwarder>::clone(&forwarder);
        let settings = ServiceSettings {
            data_dir: Some(data_dir.path().to_owned()),
            cluster: Some(Cluster { node: name.clone(), forward, catalog: Arc::new(NoCatalog) }),
            ..ServiceSettings::default()
        };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let grpc = listener.local_addr().unwrap();
        tokio::spawn(serve(listener, routes(Gate::new(access, service.clone()))));
        Self { name, service, grpc, forwarder, _data_dir: data_dir }
    }

    /// A client of a caller, with a key or without.
    pub(super) async fn client(&self, key: Option<&Secret>) -> Client {
        let client = Client::connect_with(&self.address(), &credentials(key)).await.unwrap();
        client.with_timeout(PATIENCE)
    }

    /// A client that says that it is node `c`, which asks for the holder of a key.
    pub(super) async fn client_of_node(&self, key: Option<&Secret>, caller: Option<&str>) -> Client {
        let c = NodeName::new("c").unwrap();
        let client =
            NodeClient::connect(&self.address(), &credentials(key), c, ConnectionUse::Calls, PATIENCE)
                .await
                .unwrap();
        let caller = caller.map(|caller| CallerName::new(caller).unwrap());
        client.on_behalf_of(caller.as_ref()).with_timeout(PATIENCE)
    }

    fn address(&self) -> String {
        format!("http://{}", self.grpc)
    }
}

fn credentials(key: Option<&Secret>) -> Credentials {
    let none = Credentials::default();
    key.map_or(none.clone(), |key| none.with_key(key.reveal()).unwrap())
}

fn routes(gate: Gate) -> Router {
    let admission = Admission::new(&Limits::default(), Lifecycle::default());
    let recorder = RequestRecorder::new(Metrics::new().unwrap(), Audit::default());
    let middleware = Middleware::new(gate, admission, recorder);
    let (routes, _) = mrol::grpc::routes(&middleware, MESSAGE_BYTES_MAX).unwrap();
    routes.into_axum_router()
}

async fn serve(listener: TcpListener, router: Router) {
    while let Ok((stream, _)) = listener.accept().await {
        let router = router.clone();
        let answer =
            service_fn(move |request: Request<Incoming>| router.clone().oneshot(request.map(Body::new)));
        let connection =
            http2::Builder::new(TokioExecutor::new()).serve_connection(TokioIo::new(stream), answer);
        tokio::spawn(connection);
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

/// The last claim of a map that a node has read.
async fn claim_of(service: &MapService, map: &MapName) -> Option<Uuid> {
    match &*service.lead_of(map).await.unwrap().borrow() {
        Lead::Shared { claim, .. } => *claim,
        _ => None,
    }
}
