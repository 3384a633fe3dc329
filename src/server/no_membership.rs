//! In the place of `membership`, where the program was built without clusters.

use std::net::SocketAddr;
use std::time::Duration;

use mrol_service::{Cluster, MapService};

use super::error::ServerError;
use crate::access::Access;
use crate::admission::Lifecycle;
use crate::config::Config;
use crate::telemetry::NodeReading;

/// A server's part in a cluster: none.
#[derive(Debug, Clone, Default)]
pub(super) struct Membership;

impl Membership {
    /// Nothing is to be handed over.
    pub(super) const LEAVING_MAX: Duration = Duration::ZERO;

    /// None.
    ///
    /// # Errors
    /// Where the settings give it a part.
    pub(super) fn of(
        config: &Config,
        _: (SocketAddr, SocketAddr),
        access: Access,
    ) -> Result<(Self, Access), ServerError> {
        if config.cluster.is_used() {
            return Err(ServerError::NoClusters);
        }
        Ok((Self, access))
    }

    /// None.
    pub(super) fn cluster(&self) -> Option<Cluster> {
        None
    }

    /// Nothing begins.
    pub(super) fn begin(&self, _: &MapService, _: &Lifecycle) {}

    /// Nothing is known.
    pub(super) fn reading(&self) -> Option<NodeReading> {
        None
    }

    /// Nothing is handed over.
    pub(super) async fn leave(&self, _: &MapService) {}

    /// Nothing ends.
    pub(super) async fn end(&self) {}
}
