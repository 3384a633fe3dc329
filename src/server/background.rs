//! What a server does by itself now and then.

use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use crate::admission::Lifecycle;
use crate::service::MapService;
use crate::telemetry::Metrics;
use crate::util::unix_time_ns;

/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often it is asked whether the time of keep-outs is up.
const KEEP_OUTS_DUE_INTERVAL: Duration = Duration::from_secs(1);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// Writes snapshots of the maps whose turn it is, ends the keep-outs whose time is up, and keeps the metrics small, until
/// the server is draining.
pub(super) async fn keep_house(service: MapService, metrics: Metrics, lifecycle: Lifecycle) {
    let mut saving = interval(SNAPSHOTS_DUE_INTERVAL);
    saving.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut expiring = interval(KEEP_OUTS_DUE_INTERVAL);
    expiring.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut upkeep = interval(METRICS_UPKEEP_INTERVAL);
    loop {
        tokio::select! {
            () = lifecycle.draining() => return,
            _ = upkeep.tick() => {
                metrics.upkeep();
                metrics.keep_maps(&service.map_names());
            }
            _ = expiring.tick() => {
                // Nobody waits for it: a map whose disk hangs keeps it from its end.
                let service = service.clone();
                drop(tokio::spawn(async move { service.expire_keep_outs(unix_time_ns()).await }));
            }
            _ = saving.tick() => if let Err(error) = service.save_due().await {
                tracing::error!(%error, "a snapshot cannot be written");
            },
        }
    }
}
