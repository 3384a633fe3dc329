//! What a server does by itself now and then.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use super::ReloadedFiles;
use crate::admission::Admission;
use crate::service::Gauges;
use crate::telemetry::MeteredService;

/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often what is silent is ended.
const SWEEP_INTERVAL: Duration = Duration::from_secs(1);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);
/// How often files are looked at that may have changed.
const FILES_INTERVAL: Duration = Duration::from_secs(1);
/// How often it is looked at how full disk and memory are.
const MEASURING_INTERVAL: Duration = Duration::from_secs(1);

/// Writes snapshots of the maps whose turn it is, reads files that changed, measures disk and memory, and keeps the metrics
/// small, until the server is draining.
pub(super) async fn keep_house(
    service: MeteredService,
    files: ReloadedFiles,
    gauges: Arc<dyn Gauges>,
    admission: Admission,
) {
    let mut saving = interval(SNAPSHOTS_DUE_INTERVAL);
    saving.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut upkeep = interval(METRICS_UPKEEP_INTERVAL);
    let mut sweeping = interval(SWEEP_INTERVAL);
    let mut looking = interval(FILES_INTERVAL);
    looking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut measuring = interval(MEASURING_INTERVAL);
    measuring.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = admission.lifecycle().draining() => return,
            _ = sweeping.tick() => admission.sweep(),
            _ = upkeep.tick() => service.metrics().upkeep(),
            _ = measuring.tick() => measure(&service, Arc::clone(&gauges)).await,
            _ = looking.tick(), if files.exist() => files.refresh().await,
            _ = saving.tick() => if let Err(error) = service.maps().save_due().await {
                tracing::error!(%error, "a snapshot cannot be written");
            },
        }
    }
}

/// Tells the service how full disk and memory are.
pub(super) async fn measure(service: &MeteredService, gauges: Arc<dyn Gauges>) {
    match tokio::task::spawn_blocking(move || gauges.read()).await {
        Ok(readings) => service.measured(&readings),
        Err(panic) => tracing::error!(%panic, "disk and memory cannot be measured"),
    }
}
