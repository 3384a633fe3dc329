//! What a server does by itself now and then.

use std::time::Duration;

use tokio::time::{Interval, MissedTickBehavior, interval};

use crate::admission::Lifecycle;
use crate::telemetry::Metrics;
use mrol_map::util::unix_time_ns;
use mrol_service::MapService;

/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often it is asked whether the time of keep-outs is up.
const KEEP_OUTS_DUE_INTERVAL: Duration = Duration::from_secs(1);
/// How often it is asked which maps nobody uses.
const SLEEP_DUE_INTERVAL: Duration = Duration::from_millis(500);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// Writes snapshots of the maps whose turn it is, ends the keep-outs whose time is up, puts maps to sleep that nobody
/// uses, and keeps the metrics small, until the server is draining. None of these waits for another: a disk that hangs
/// keeps the snapshots from their end alone.
pub(super) async fn keep_house(service: MapService, metrics: Metrics, lifecycle: Lifecycle) {
    let saving = save_snapshots(service.clone(), Times::every(SNAPSHOTS_DUE_INTERVAL, &lifecycle));
    let expiring = end_keep_outs(service.clone(), Times::every(KEEP_OUTS_DUE_INTERVAL, &lifecycle));
    let upkeep = keep_metrics(service.clone(), metrics, Times::every(METRICS_UPKEEP_INTERVAL, &lifecycle));
    let sleeping = put_to_sleep(service, Times::every(SLEEP_DUE_INTERVAL, &lifecycle));
    tokio::join!(saving, expiring, upkeep, sleeping);
}

async fn save_snapshots(service: MapService, mut due: Times) {
    while due.is_next().await {
        if let Err(error) = service.save_due().await {
            tracing::error!(%error, "a snapshot cannot be written");
        }
    }
}

async fn end_keep_outs(service: MapService, mut due: Times) {
    while due.is_next().await {
        // Nobody waits for it: a map whose disk hangs keeps it from its end.
        let service = service.clone();
        drop(tokio::spawn(async move { service.expire_keep_outs(unix_time_ns()).await }));
    }
}

async fn put_to_sleep(service: MapService, mut due: Times) {
    while due.is_next().await {
        service.put_unused_to_sleep().await;
    }
}

async fn keep_metrics(service: MapService, metrics: Metrics, mut due: Times) {
    while due.is_next().await {
        metrics.upkeep();
        metrics.keep_maps(&service.map_names());
    }
}

/// Times at which something is due, until the server is draining.
struct Times {
    interval: Interval,
    lifecycle: Lifecycle,
}

impl Times {
    fn every(period: Duration, lifecycle: &Lifecycle) -> Self {
        let mut interval = interval(period);
        interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self { interval, lifecycle: lifecycle.clone() }
    }

    /// Waits for the next time; false once the server is draining.
    async fn is_next(&mut self) -> bool {
        tokio::select! {
            () = self.lifecycle.draining() => false,
            _ = self.interval.tick() => true,
        }
    }
}
