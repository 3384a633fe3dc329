//! What a server does by itself now and then.

use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use crate::admission::Lifecycle;
use crate::service::MapService;
use crate::telemetry::Metrics;

/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// Writes snapshots of the maps whose turn it is, and keeps the metrics small, until the server is
/// draining.
pub(super) async fn keep_house(service: MapService, metrics: Metrics, lifecycle: Lifecycle) {
    let mut saving = interval(SNAPSHOTS_DUE_INTERVAL);
    saving.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut upkeep = interval(METRICS_UPKEEP_INTERVAL);
    loop {
        tokio::select! {
            () = lifecycle.draining() => return,
            _ = upkeep.tick() => {
                metrics.upkeep();
                metrics.keep_maps(&service.map_names());
            }
            _ = saving.tick() => if let Err(error) = service.save_due().await {
                tracing::error!(%error, "a snapshot cannot be written");
            },
        }
    }
}
