//! Puts a base, and cuts the front of a log off.

use std::sync::Arc;
use std::time::Instant;

use mrol_map::map::MapName;
use mrol_service::MapService;
use mrol_service::replication::Base;
use uuid::Uuid;

use super::blocking::blocking;
use super::settings::BaseLimits;
use crate::bases::BaseError;
use crate::jetstream_log::JetStreamLog;
use crate::store::ClusterStore;

/// Puts bases for a map that this node leads.
pub(super) struct Cutting {
    joined: ClusterStore,
    log: Arc<JetStreamLog>,
    map: Uuid,
    limits: BaseLimits,
    looked: Instant,
}

impl Cutting {
    pub(super) fn of(joined: ClusterStore, log: Arc<JetStreamLog>, map: Uuid, limits: BaseLimits) -> Self {
        Self { joined, log, map, limits, looked: Instant::now() }
    }

    /// Puts a base where one is due, and cuts the log off at the one before: a node that loads that one just now goes
    /// on. `needed` is the first message that a live node has still to read.
    pub(super) async fn look(&mut self, service: &MapService, name: &MapName, needed: u64) {
        if self.looked.elapsed() < self.limits.looked_every {
            return;
        }
        self.looked = Instant::now();
        if let Err(why) = self.cut_if_due(service, name, needed).await {
            tracing::warn!(map = %name, why, "the log is not cut: it is tried again");
        }
    }

    async fn cut_if_due(&self, service: &MapService, name: &MapName, needed: u64) -> Result<(), String> {
        let (joined, log, map, limits) = (self.joined.clone(), Arc::clone(&self.log), self.map, self.limits);
        let found = blocking(move || -> Result<_, String> {
            let before = joined.pointers.read(map).map_err(|error| error.to_string())?;
            let used = log.used().map_err(|error| error.to_string())?;
            let base = before.as_ref().map_or(0, |(base, _)| base.position.sequence);
            // Of what is kept, the part behind the base, by its share of the messages.
            let behind = used.last_sequence.saturating_sub(base);
            let bytes = used.bytes.saturating_mul(behind) / used.messages.max(1);
            Ok((before, behind >= limits.messages_max || bytes >= limits.bytes_max))
        });
        let (before, is_due) = found.await?;
        if !is_due {
            return Ok(());
        }
        let copy = service.log_base(name).await.map_err(|error| error.to_string())?;
        let Some((base, file)) = copy else { return Ok(()) };
        let (joined, log) = (self.joined.clone(), Arc::clone(&self.log));
        let put = blocking(move || put_base(&joined, &log, map, before.as_ref(), (&base, &file), needed));
        put.await.map_err(|error| error.to_string())?;
        tracing::info!(map = %name, "a base was put, and the log cut behind the one before");
        Ok(())
    }
}

fn put_base(
    joined: &ClusterStore,
    log: &JetStreamLog,
    map: Uuid,
    before: Option<&(Base, u64)>,
    (base, file): (&Base, &[u8]),
    needed: u64,
) -> Result<(), BaseError> {
    joined.bases.put(map, base, file)?;
    joined.pointers.change(map, base, before.map_or(0, |(_, revision)| *revision))?;
    let Some((before, _)) = before else { return Ok(()) };
    if before.position.sequence > 0 {
        log.cut_before(before.position.sequence.min(needed))
            .map_err(|error| BaseError::Unavailable(error.to_string()))?;
    }
    joined.bases.delete(map, before)
}
