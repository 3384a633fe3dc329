//! What a server looks at every second: how much is in use, and how much room there is.

use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use super::membership::Membership;
use crate::admission::Admission;
use crate::telemetry::Metrics;
use mrol_service::MapService;

/// How often.
const INTERVAL: Duration = Duration::from_secs(1);
/// The size of a block so large that the allocator has it from the system, and not from what it keeps for small ones.
const LARGE_BLOCK: usize = 4 << 20;

/// Measures disk and memory, looks what a node knows of its cluster, ends what is silent, and tells the metrics, until
/// the server is draining. It is a task of its own: a snapshot that takes long does not keep it from looking.
pub(super) async fn watch(
    service: MapService,
    metrics: Metrics,
    admission: Admission,
    membership: Membership,
) {
    let mut looking = interval(INTERVAL);
    looking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = admission.lifecycle().draining() => return,
            _ = looking.tick() => {}
        }
        admission.sweep();
        metrics.in_use(&admission.in_use());
        if let Some(node) = membership.reading() {
            metrics.node(node);
        }
        measure(&service, &metrics).await;
    }
}

/// Looks how full disk and memory are, on a thread that may block.
pub(super) async fn measure(service: &MapService, metrics: &Metrics) {
    let (service, metrics) = (service.clone(), metrics.clone());
    let measuring = move || {
        free_a_large_block();
        let readings = service.measure();
        metrics.room(&readings, &service.shortages());
    };
    if let Err(panic) = tokio::task::spawn_blocking(measuring).await {
        tracing::error!(%panic, "disk and memory cannot be measured");
    }
}

/// The program's allocator keeps what was freed for a second, and then gives it back when the next large block is
/// freed. With the last map gone nobody else may free one, and a shortage of memory would last. The block is never
/// written, so that it costs nothing.
fn free_a_large_block() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGE_BLOCK)));
}
