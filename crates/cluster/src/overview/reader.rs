//! Looks at a cluster again and again.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

use mrol_service::replication::NodeName;

use super::seen::{Overview, SeenNode};
use crate::beats::{BEAT_EVERY, NodeBeat};
use crate::bucket::BucketError;
use crate::catalog::CatalogError;
use crate::store::ClusterStore;

/// How long a node that does not beat is waited for: a beat, and a half more for one that is late.
const SILENT_AFTER: Duration = Duration::from_secs(3);
/// How often it is looked meanwhile.
const LOOKED_EVERY: Duration = Duration::from_millis(200);
/// How long a look may fail: a server of NATS that lags by a moment answers with what was before.
const TRIED_FOR: Duration = Duration::from_secs(3);

/// Looks at a cluster again and again: a node is live that has beaten since the first look.
#[derive(Debug)]
pub struct OverviewReader {
    store: ClusterStore,
    /// The beats that were there at the first look.
    first: BTreeMap<NodeName, u64>,
    begun: Instant,
}

/// Why a cluster was not seen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OverviewError {
    /// The beats were not read.
    #[error("the nodes cannot be listed: {0}")]
    Beats(#[from] BucketError),
    /// The list of maps was not read.
    #[error("the maps of the cluster cannot be listed: {0}")]
    Catalog(#[from] CatalogError),
}

impl OverviewReader {
    /// How long a node must not beat to count as silent.
    pub const SILENT_AFTER: Duration = SILENT_AFTER;

    /// Looks first. Not for an async thread.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn begin(store: ClusterStore) -> Result<Self, OverviewError> {
        let first = patiently(|| Ok(store.beats.read()?))?
            .into_iter()
            .map(|beat| (beat.node, beat.revision))
            .collect();
        Ok(Self { store, first, begun: Instant::now() })
    }

    /// What is at NATS.
    pub fn store(&self) -> &ClusterStore {
        &self.store
    }

    /// Looks once more.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn look(&self) -> Result<Overview, OverviewError> {
        let (listing, _) = patiently(|| Ok(self.store.catalog.read()?))?;
        let seen = |NodeBeat { node, revision, beat }: NodeBeat| {
            // A server of NATS that lags shows an older beat.
            let is_live = self.first.get(&node).is_none_or(|first| revision > *first) && !beat.has_ended;
            SeenNode { node, is_live, beat }
        };
        Ok(Overview::of(
            &listing,
            patiently(|| Ok(self.store.beats.read()?))?.into_iter().map(seen).collect(),
        ))
    }

    /// Looks until every node has beaten, or those that have not are silent.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn settled(&self) -> Result<Overview, OverviewError> {
        loop {
            let seen = self.look()?;
            let are_live = seen.nodes.iter().all(|node| node.is_live || node.beat.has_ended);
            if are_live || self.begun.elapsed() >= SILENT_AFTER {
                return Ok(seen);
            }
            thread::sleep(LOOKED_EVERY);
        }
    }
}

/// Looks again until it is seen, for a while.
fn patiently<T>(look: impl Fn() -> Result<T, OverviewError>) -> Result<T, OverviewError> {
    let begun = Instant::now();
    loop {
        match look() {
            Err(_) if begun.elapsed() < TRIED_FOR => thread::sleep(LOOKED_EVERY),
            seen => return seen,
        }
    }
}

const _: () = assert!(SILENT_AFTER.as_millis() >= BEAT_EVERY.as_millis() * 3 / 2);
