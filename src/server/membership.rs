//! The server as a node of a cluster.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use mrol_cluster::{
    BaseLimits, Credentials, EngineSettings, Forwarder, ForwarderSettings, Node, NodeCertificate,
    NodeSettings,
};
use mrol_service::{Cluster, MapService};
use mrol_store::JOURNAL_VERSION;
use tokio::time::interval;

use super::error::ServerError;
use crate::access::{Access, read_cluster_secret};
use crate::admission::Lifecycle;
use crate::config::{ClusterConfig, Config, advertised};
use crate::telemetry::NodeReading;

/// How often it is looked whether the node is behind.
const LOOKED_EVERY: Duration = Duration::from_secs(1);

/// How long after the last beat that NATS acknowledged a node still counts as joined: five beats.
const JOINED_FOR: Duration = Duration::from_secs(10);

/// A server's part in a cluster; nothing of a server by itself. A clone is the same part.
#[derive(Debug, Clone, Default)]
pub(super) struct Membership(Option<Member>);

#[derive(Debug, Clone)]
struct Member {
    node: Arc<Node>,
    /// How far behind the others it may be.
    lag_max: Duration,
}

impl Membership {
    /// How long a node may take to hand its maps over when it is told to end.
    pub(super) const LEAVING_MAX: Duration = Node::LEAVING_MAX;

    /// The part that the settings give it, and the access that other nodes have besides.
    ///
    /// # Errors
    /// When a file cannot be read, or an address is not known.
    pub(super) fn of(
        config: &Config,
        (http, grpc): (SocketAddr, SocketAddr),
        access: Access,
    ) -> Result<(Self, Access), ServerError> {
        let cluster = &config.cluster;
        let Some(name) = cluster.node_name().filter(|_| cluster.is_used()) else {
            return Ok((Self::default(), access));
        };
        let secret = cluster.secret_file.as_deref().map(read_cluster_secret).transpose()?;
        let access = match &secret {
            Some(secret) => access.with_cluster_secret(secret),
            None => access,
        };
        let is_secured = config.tls.certificate.is_some();
        let certificate = config.tls.certificate.clone().zip(config.tls.key.clone());
        let forwarder = Forwarder::new(ForwarderSettings {
            secret: secret.map(|secret| secret.reveal().to_owned()),
            root_certificates: cluster.ca.clone(),
            // Nodes that ask their clients for a certificate are shown that of this one.
            certificate: certificate
                .filter(|_| config.tls.client_ca.is_some())
                .map(|(certificate, key)| NodeCertificate { certificate, key }),
            ..ForwarderSettings::new(name.clone())
        })?;
        let settings = NodeSettings {
            http: advertised("cluster.http", cluster.http.as_ref(), http, is_secured)?,
            grpc: advertised("cluster.grpc", cluster.grpc.as_ref(), grpc, is_secured)?,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            record_version: JOURNAL_VERSION,
            copies: cluster.copies as usize,
            engine: engine_settings(cluster, name.as_str()),
            bases: BaseLimits::default(),
            name,
        };
        let (node, lag_max) = (Node::new(settings, forwarder), cluster.lag_max());
        Ok((Self(Some(Member { node, lag_max })), access))
    }

    /// What the operations of the service have of it.
    pub(super) fn cluster(&self) -> Option<Cluster> {
        self.0.as_ref().map(|member| member.node.cluster())
    }

    /// Begins to work; `lifecycle` is told when the node is behind the others for longer than the settings allow.
    pub(super) fn begin(&self, service: &MapService, lifecycle: &Lifecycle) {
        let Some(Member { node, lag_max }) = self.0.clone() else { return };
        node.begin(service.clone());
        // Before anybody can ask.
        lifecycle.set_behind(node.is_behind(lag_max));
        let lifecycle = lifecycle.clone();
        lifecycle.set_behind(true);
        tokio::spawn(async move {
            let mut due = interval(LOOKED_EVERY);
            while !lifecycle.is_draining() {
                due.tick().await;
                lifecycle.set_behind(node.is_behind(lag_max));
            }
        });
    }

    /// What it knows of the cluster, for the metrics.
    pub(super) fn reading(&self) -> Option<NodeReading> {
        let Member { node, lag_max } = self.0.as_ref()?;
        let status = node.status();
        let gone = status.gone.len();
        Some(NodeReading {
            is_joined: status.seen.is_some_and(|seen| seen <= JOINED_FOR),
            is_behind: node.is_behind(*lag_max),
            live: status.grpc.len() + 1 - gone,
            gone,
            furthest: status.furthest,
            takeovers: status.takeovers,
            acknowledgments: status.acknowledgments,
        })
    }

    /// Hands the maps that it leads over to other nodes.
    pub(super) async fn leave(&self, service: &MapService) {
        if let Some(Member { node, .. }) = &self.0 {
            node.leave(service).await;
        }
    }

    /// Ends its work.
    pub(super) async fn end(&self) {
        if let Some(Member { node, .. }) = &self.0 {
            node.end().await;
        }
    }
}

/// How a node reaches NATS.
pub fn engine_settings(cluster: &ClusterConfig, name: &str) -> EngineSettings {
    let credentials = match (&cluster.credentials_file, &cluster.nkey_file) {
        (Some(file), _) => Credentials::CredentialsFile(file.clone()),
        (None, Some(file)) => Credentials::NkeySeedFile(file.clone()),
        (None, None) => Credentials::None,
    };
    EngineSettings {
        urls: cluster.nats.clone(),
        credentials,
        root_certificates: cluster.ca.clone(),
        replicas: cluster.replicas as usize,
        name: format!("mrol {name}"),
    }
}
