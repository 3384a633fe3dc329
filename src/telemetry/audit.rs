//! The audit: a log line for each change by an operator, and for each key that was refused.
//!
//! Lines have the target [`AUDIT`] and lie within the request's span, which says the protocol, the request id, the key
//! and the peer.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};

use crate::service::{Change, End, Ended, MapVersion, Observer, Outcome};

/// The target of the audit's lines.
pub const AUDIT: &str = "mrol::audit";

/// Requests that were refused or failed and are written one by one, a second. Whoever has no key may send any number of
/// them, and must not fill the disk of the log: the others are counted in the next line.
const REFUSALS_PER_S_MAX: NonZeroU32 = NonZeroU32::new(10).expect("not zero");

/// Operations whose refusal and failure are lines of their own; those that are done tell by their outcome.
const CHANGES: [&str; 5] = ["CreateMap", "DeleteMap", "RestoreMap", "DeleteVoxels", "Undo"];

/// Writes the audit. A clone is another handle on the same one.
#[derive(Debug, Clone)]
pub struct Audit(Arc<Refusals>);

#[derive(Debug)]
struct Refusals {
    rate: DefaultDirectRateLimiter,
    /// Refusals that were not written since the last that was.
    unwritten: AtomicU64,
}

impl Default for Audit {
    fn default() -> Self {
        let rate = RateLimiter::direct(Quota::per_second(REFUSALS_PER_S_MAX));
        Self(Arc::new(Refusals { rate, unwritten: AtomicU64::new(0) }))
    }
}

impl Audit {
    /// A request was not let in, by the word `reason`; to be called within its span.
    pub fn denied(&self, reason: &str) {
        if let Some(unwritten) = self.0.to_write() {
            tracing::info!(target: AUDIT, outcome = "denied", reason, unwritten, "not let in");
        }
    }
}

impl Refusals {
    /// How many refusals were not written since the last that was; none where this one is not written either.
    fn to_write(&self) -> Option<u64> {
        if self.rate.check().is_err() {
            self.unwritten.fetch_add(1, Ordering::Relaxed);
            return None;
        }
        Some(self.unwritten.swap(0, Ordering::Relaxed))
    }
}

/// Writes changes of maps, done, failed or left by their callers.
impl Observer for Audit {
    fn operation_ended(&self, ended: &Ended<'_>) {
        let Ended { operation, map, end, .. } = ended;
        let map = map.map(|map| map.as_str());
        match end {
            End::Done(Outcome::Changed(change)) => {
                let Change { before, after, voxels_removed, scans_undone, replayed } = change;
                let uuid = after.or(*before).map(|version| version.map_uuid.to_string());
                let uuid_before =
                    before.filter(|before| after.is_some_and(|after| after.map_uuid != before.map_uuid));
                let uuid_before = uuid_before.map(|before| before.map_uuid.to_string());
                let revision = |version: &Option<MapVersion>| version.map(|version| version.revision);
                let (revision_before, revision) = (revision(before), revision(after));
                let outcome = if *replayed { "unchanged" } else { "done" };
                tracing::info!(
                    target: AUDIT, operation, map, uuid, uuid_before, revision_before, revision, voxels_removed,
                    scans_undone, outcome, "change"
                );
            }
            End::Done(_) => {}
            End::Failed(error) if CHANGES.contains(operation) => {
                let reason = error.reason.as_str();
                if let Some(unwritten) = self.0.to_write() {
                    tracing::info!(
                        target: AUDIT, operation, map, outcome = "failed", reason, %error, unwritten, "change"
                    );
                }
            }
            End::CallerGone if CHANGES.contains(operation) => {
                // The change may be made, so this one is always written.
                tracing::info!(target: AUDIT, operation, map, outcome = "caller_gone", "change");
            }
            End::Failed(_) | End::CallerGone => {}
        }
    }
}
