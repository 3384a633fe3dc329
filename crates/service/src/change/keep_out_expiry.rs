//! How the server ends keep-outs whose time is up.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::keep_out::decided;
use crate::commit::{Lead, Refusal, Submission};
use crate::error::ServiceError;
use crate::map_service::{MapService, commit_thread_ended};
use crate::maps::HostedMap;
use crate::resources::ResourceBudget;
use crate::work::{Asker, Requester};
use mrol_map::map::{KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOuts, MultiResolutionMap};
use mrol_map::util::StopSignal;

impl MapService {
    /// Ends the keep-outs of all maps whose time is up at `now_ns`, nanoseconds since the Unix epoch; how many ended.
    /// To be called at start, and every second or so. A map whose disk hangs keeps this call waiting, and no other:
    /// until it is over, later calls leave that map out.
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
    /// True of a map that takes changes here and has a keep-out whose time is up. Where keep-outs change just now, the
    /// next call sees them.
    fn has_expired(&self, now_ns: i64) -> bool {
        let has_one = |keep_outs: Arc<KeepOuts>| keep_outs.expired(now_ns).next().is_some();
        let is_made_here = matches!(self.lead(), Lead::Alone | Lead::Shared { is_here: true, .. });
        is_made_here && self.commit_queue.stopped().is_none() && self.map.try_keep_outs().is_some_and(has_one)
    }

    /// Ends the keep-outs whose time is up; how many ended. One that cannot be ended is left for the next call, and
    /// that is logged once.
    async fn expire_keep_outs(self: Arc<Self>, now_ns: i64, budget: &ResourceBudget) -> usize {
        let Ok(_attempt) = self.keep_out_expiry.lock.try_lock() else { return 0 };
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
        self.keep_out_expiry.is_put_off.store(false, Ordering::Relaxed);
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
        let outcome = self
            .commit_queue
            .submit(&Requester::from(&Asker::default()), Submission::Undecided(Box::new(decide)))?;
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
        if takes_changes && !self.keep_out_expiry.is_put_off.swap(true, Ordering::Relaxed) {
            let (map, why) = (&self.name, &why.message);
            tracing::warn!(%map, keep_out = %name, why, "keep-outs whose time is up stay for now");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::request::PutKeepOut;
    use crate::settings::ServiceSettings;
    use mrol_map::map::{KeepOutShape, MapName, MapSettings, Region};
    use mrol_store::{OpeningProgress, StoreSettings};

    const NEVER_YET: i64 = i64::MAX - 10;

    async fn service_with(settings: ServiceSettings, expiries: &[i64]) -> (MapService, MapName) {
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let map = MapName::new("a").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 4)).await.unwrap();
        for (i, &expires_at_ns) in expiries.iter().enumerate() {
            put(&service, &map, i, Some(expires_at_ns)).await;
        }
        (service, map)
    }

    async fn put(service: &MapService, map: &MapName, i: usize, expires_at_ns: Option<i64>) {
        let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
        let name = KeepOutName::new(&format!("k{i}")).unwrap();
        let put = PutKeepOut { name, shape, expires_at_ns, request_id: None };
        service.put_keep_out(map, put).await.unwrap();
    }

    async fn names(service: &MapService, map: &MapName) -> Vec<String> {
        let all = service.list_keep_outs(map).await.unwrap().keep_outs;
        all.iter().map(|keep_out| keep_out.name.to_string()).collect()
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn keep_outs_end_at_their_time_each_by_a_revision_and_once() {
        let expiries = [NEVER_YET, NEVER_YET + 1, NEVER_YET + 2];
        let (service, map) = service_with(ServiceSettings::default(), &expiries).await;
        put(&service, &map, 3, None).await;
        assert_eq!(service.expire_keep_outs(NEVER_YET - 1).await, 0);
        assert_eq!(service.expire_keep_outs(NEVER_YET + 1).await, 2);
        assert_eq!(service.expire_keep_outs(NEVER_YET + 1).await, 0);
        assert_eq!(names(&service, &map).await, ["k2", "k3"]);
        // One that was put again has another time, or none.
        put(&service, &map, 2, None).await;
        assert_eq!(service.expire_keep_outs(i64::MAX).await, 0);
        assert_eq!(service.list_keep_outs(&map).await.unwrap().version.revision, 7);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_map_whose_journal_failed_keeps_its_keep_outs_and_is_not_asked_again() {
        let data = tempfile::tempdir().unwrap();
        let folder = data.path().join("data");
        // Each record begins a segment, whose folder is not there any more then.
        let store = StoreSettings { segment_bytes_max: 1, ..StoreSettings::default() };
        let settings =
            ServiceSettings { data_dir: Some(folder.clone()), store, ..ServiceSettings::default() };
        let (service, map) = service_with(settings, &[NEVER_YET, NEVER_YET]).await;
        std::fs::rename(folder.join("maps"), data.path().join("away")).unwrap();
        assert_eq!(service.expire_keep_outs(i64::MAX).await, 0);
        let hosted = service.map(&map).await.unwrap();
        assert!(hosted.commit_queue.stopped().is_some() && !hosted.has_expired(i64::MAX));
        assert!(
            !hosted.keep_out_expiry.is_put_off.load(Ordering::Relaxed),
            "that it failed was said where it did"
        );
        assert_eq!(service.expire_keep_outs(i64::MAX).await, 0);
        assert_eq!(names(&service, &map).await, ["k0", "k1"]);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_map_that_is_being_asked_is_left_out_and_keeps_no_other_waiting() {
        let (service, map) = service_with(ServiceSettings::default(), &[NEVER_YET]).await;
        let hosted = service.map(&map).await.unwrap();
        let turn = hosted.keep_out_expiry.lock.lock().await;
        let left_out = tokio::time::timeout(Duration::from_secs(20), service.expire_keep_outs(i64::MAX));
        assert_eq!(left_out.await.unwrap(), 0);
        drop(turn);
        assert_eq!(service.expire_keep_outs(i64::MAX).await, 1);
    }
}
