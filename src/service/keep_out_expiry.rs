//! How the server ends keep-outs whose time is up.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::commit_queue::{Refusal, Submission};
use super::hosted_map::HostedMap;
use super::keep_out::decided;
use super::resource_budget::ResourceBudget;
use super::{MapService, ServiceError, commit_thread_ended};
use crate::map::{KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOuts, MultiResolutionMap};
use crate::util::StopSignal;

impl MapService {
    /// Ends the keep-outs of all maps whose time is up at `now_ns`, nanoseconds since the Unix epoch; how many ended. To be
    /// called at start, and every second or so. A map whose disk hangs keeps this call waiting, and no other: until it
    /// is over, later calls leave that map out.
    pub async fn expire_keep_outs(&self, now_ns: i64) -> usize {
        let mut ended = 0;
        let due = self.inner.catalog.all().into_iter().filter(|map| map.has_expired(now_ns));
        let ending = due.map(|map| {
            let inner = Arc::clone(&self.inner);
            tokio::spawn(async move { map.expire_keep_outs(now_ns, &inner.budget).await })
        });
        for map in ending.collect::<Vec<_>>() {
            ended += map.await.unwrap_or_default();
        }
        ended
    }
}

impl HostedMap {
    /// True of a map that takes changes and has a keep-out whose time is up. Where keep-outs change just now, the next call
    /// sees them.
    fn has_expired(&self, now_ns: i64) -> bool {
        let has_one = |keep_outs: Arc<KeepOuts>| keep_outs.expired(now_ns).next().is_some();
        self.commit_queue.stopped().is_none() && self.map.try_keep_outs().is_some_and(has_one)
    }

    /// Ends the keep-outs whose time is up; how many ended. One that cannot be ended is left for the next call, and that is
    /// logged once.
    async fn expire_keep_outs(self: Arc<Self>, now_ns: i64, budget: &ResourceBudget) -> usize {
        let Ok(_turn) = self.expiring.try_lock() else { return 0 };
        let Some(keep_outs) = self.map.try_keep_outs() else { return 0 };
        let mut ended = 0;
        for keep_out in keep_outs.expired(now_ns) {
            match self.expire_keep_out(&keep_out.name, now_ns, budget).await {
                Ok(is_ended) => ended += usize::from(is_ended),
                Err(refused) => {
                    self.put_expiry_off(&keep_out.name, &refused);
                    return ended;
                }
            }
        }
        self.is_expiry_put_off.store(false, Ordering::Relaxed);
        ended
    }

    /// False where it was put again, or removed, meanwhile.
    async fn expire_keep_out(
        &self,
        name: &KeepOutName,
        now_ns: i64,
        budget: &ResourceBudget,
    ) -> Result<bool, ServiceError> {
        self.check_writable()?;
        budget.check_to_shrink()?;
        let change = KeepOutChange { name: name.clone(), act: KeepOutAct::Expired };
        let decide = move |core: &MultiResolutionMap, _: StopSignal<'_>| match core
            .keep_outs()
            .expired(now_ns)
            .any(|it| it.name == change.name)
        {
            true => Ok(Some(decided(KeepOutRecord { change, request: None }))),
            false => Err(Refusal::Stale),
        };
        let outcome = self.commit_queue.submit(Submission::Undecided(Box::new(decide)))?;
        match outcome.await.map_err(commit_thread_ended)? {
            Ok(committed) => {
                let (map, revision) = (&self.name, committed.revision);
                tracing::info!(%map, keep_out = %name, revision, "the time of a keep-out is up");
                Ok(true)
            }
            Err(Refusal::Failed(error)) => Err(error),
            Err(Refusal::Stale) => Ok(false),
        }
    }

    /// Says once why keep-outs do not end. Of a map that takes no more changes that is known.
    fn put_expiry_off(&self, name: &KeepOutName, why: &ServiceError) {
        let takes_changes = self.commit_queue.stopped().is_none();
        if takes_changes && !self.is_expiry_put_off.swap(true, Ordering::Relaxed) {
            let (map, why) = (&self.name, &why.message);
            tracing::warn!(%map, keep_out = %name, why, "keep-outs whose time is up stay for now");
        }
    }
}
