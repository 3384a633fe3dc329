//! What a server does by itself now and then.

use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use super::ReloadedFiles;
use crate::lifecycle::Lifecycle;
use crate::telemetry::MeteredService;

/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);
/// How often files are looked at that may have changed.
const FILES_INTERVAL: Duration = Duration::from_secs(1);

/// Writes snapshots of the maps whose turn it is, reads files that changed, and keeps the metrics small, until the server is
/// draining.
pub(super) async fn keep_house(service: MeteredService, files: ReloadedFiles, lifecycle: Lifecycle) {
    let mut saving = interval(SNAPSHOTS_DUE_INTERVAL);
    saving.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut upkeep = interval(METRICS_UPKEEP_INTERVAL);
    let mut looking = interval(FILES_INTERVAL);
    looking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = lifecycle.draining() => return,
            _ = upkeep.tick() => service.upkeep(),
            _ = looking.tick(), if files.exist() => files.refresh().await,
            _ = saving.tick() => if let Err(error) = service.maps().save_due().await {
                tracing::error!(%error, "a snapshot cannot be written");
            },
        }
    }
}
