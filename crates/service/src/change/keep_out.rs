//! How keep-outs are put, removed and listed.

use std::sync::Arc;

use super::digest::Digest;
use crate::commit::{Decided, Refusal, Step, Submission};
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::{Change, Outcome};
use crate::request::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut};
use crate::resources::ResourceBudget;
use crate::work::Requester;
use mrol_map::map::{
    self, Committed, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, KeepOuts, MapName,
    MultiResolutionMap, Request, RequestId, RequestKind,
};
use mrol_map::util::{StopSignal, unix_time_ns};

impl MapService {
    /// Puts a keep-out: a new one, or in the place of the one of its name.
    ///
    /// # Errors
    /// `InvalidArgument` for a prism of too many corners, or an expiry in the past; `ResourceExhausted` beyond
    /// `keep_outs_max`, or while the disk is nearly full; `NotFound` without such a map.
    pub async fn put_keep_out(&self, map: &MapName, put: PutKeepOut) -> Result<KeepOutAnswer, ServiceError> {
        let work = async {
            self.limits().check_corners(put.shape.corners())?;
            let map = self.map(map).await?;
            self.at_the_leader(
                &map,
                || {
                    let PutKeepOut { name, shape, expires_at_ns, request_id } = put.clone();
                    let act = KeepOutAct::Put { shape, made_by: self.caller.clone(), expires_at_ns };
                    self.change_keep_out(&map, KeepOutChange { name, act }, request_id)
                },
                |leader, call| {
                    let put = put.clone();
                    async move { leader.put_keep_out(&call, put).await }
                },
            )
            .await
        };
        self.observed("PutKeepOut", Some(map), work, |answer| Outcome::Changed(Change::of_keep_out(answer)))
            .await
    }

    /// Removes a keep-out.
    ///
    /// # Errors
    /// `NotFound` without such a map or keep-out; `ResourceExhausted` while the disk is nearly full.
    pub async fn delete_keep_out(
        &self,
        map: &MapName,
        deletion: DeleteKeepOut,
    ) -> Result<KeepOutAnswer, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            self.at_the_leader(
                &map,
                || {
                    let DeleteKeepOut { name, request_id } = deletion.clone();
                    let act = KeepOutAct::Removed { by: self.caller.clone() };
                    self.change_keep_out(&map, KeepOutChange { name, act }, request_id)
                },
                |leader, call| {
                    let deletion = deletion.clone();
                    async move { leader.delete_keep_out(&call, deletion).await }
                },
            )
            .await
        };
        self.observed("DeleteKeepOut", Some(map), work, |answer| {
            Outcome::Changed(Change::of_keep_out(answer))
        })
        .await
    }

    /// The keep-outs of a map, all at one revision.
    ///
    /// # Errors
    /// `NotFound` without such a map; `ResourceExhausted` when too many jobs wait.
    pub async fn list_keep_outs(&self, map: &MapName) -> Result<KeepOutList, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            self.inner.lanes.reads.run(&self.asker, move |_| map.list_keep_outs()).await
        };
        self.observed("ListKeepOuts", Some(map), work, |_| Outcome::Read).await
    }

    async fn change_keep_out(
        &self,
        map: &Arc<HostedMap>,
        change: KeepOutChange,
        request_id: Option<RequestId>,
    ) -> Result<KeepOutAnswer, ServiceError> {
        let request =
            request_id.map(|id| Request { id, digest: digest(&change), caller: self.caller.clone() });
        let (inner, record) = (Arc::clone(&self.inner), KeepOutRecord { change, request });
        let of = Arc::clone(map);
        let submit = move |_: StopSignal<'_>| {
            of.prepare_keep_out(&record, &inner.settings.limits, &inner.budget, unix_time_ns())
        };
        let lane = (&self.inner.lanes.mapping, &Requester::from(&self.asker));
        self.submit_and_wait(("ChangeKeepOut", map), lane, None, submit).await
    }
}

impl HostedMap {
    /// Prepares a keep-out's change, unless it was made before.
    fn prepare_keep_out(
        self: &Arc<Self>,
        record: &KeepOutRecord,
        limits: &Limits,
        budget: &ResourceBudget,
        now_ns: i64,
    ) -> Result<Step<KeepOutAnswer>, ServiceError> {
        self.check_writable()?;
        let answered = self.keep_out_answered(record.request.as_ref())?;
        if let Some(answered) = answered {
            let version = self.version_at(answered);
            return Ok(Step::Answered(KeepOutAnswer { version, replayed: true }));
        }
        check_expiry(&record.change, now_ns)?;
        budget.check_to_shrink()?;
        let (map, record, most) = (Arc::clone(self), record.clone(), limits.keep_outs_max);
        // Whether it is there, or has room, is known when nobody else can change the map.
        let decide = move |core: &MultiResolutionMap, _: StopSignal<'_>| {
            if map.keep_out_answered(record.request.as_ref())?.is_some() {
                return Err(Refusal::Stale);
            }
            map.check_keep_out(&core.keep_outs(), &record.change, most)?;
            Ok(Some(decided(record)))
        };
        let map = Arc::clone(self);
        let answer = move |committed: Committed| KeepOutAnswer {
            version: map.version(committed.version()),
            replayed: false,
        };
        Ok(Step::Ready(Submission::Undecided(Box::new(decide)), Box::new(answer)))
    }

    /// The revision that the same request made before.
    fn keep_out_answered(&self, request: Option<&Request>) -> Result<Option<u64>, ServiceError> {
        let former = request.map_or(0, |request| request.digest);
        Ok(self.answered(RequestKind::KeepOut, request, former)?.map(|answered| answered.revision))
    }

    fn check_keep_out(
        &self,
        all: &KeepOuts,
        change: &KeepOutChange,
        most: usize,
    ) -> Result<(), ServiceError> {
        match change.act {
            KeepOutAct::Put { .. } => {
                let full =
                    |full: map::KeepOutsFull| ServiceError::new(Reason::TooManyKeepOuts, full.to_string());
                all.check_room_for(&change.name, most).map_err(full)
            }
            KeepOutAct::Removed { .. } | KeepOutAct::Expired if all.get(&change.name).is_none() => {
                Err(self.no_keep_out(&change.name))
            }
            KeepOutAct::Removed { .. } | KeepOutAct::Expired => Ok(()),
        }
    }

    fn no_keep_out(&self, name: &KeepOutName) -> ServiceError {
        let message = format!("map {} has no keep-out {name}", self.name);
        ServiceError::new(Reason::KeepOutNotFound, message)
    }

    fn list_keep_outs(&self) -> KeepOutList {
        let (keep_outs, version) = self.map.keep_outs_and_version();
        KeepOutList { keep_outs: keep_outs.iter().cloned().collect(), version: self.version(version) }
    }
}

/// A change of a keep-out as a thread for commits makes it.
pub(super) fn decided(record: KeepOutRecord) -> Decided {
    Decided { change: map::Change::KeepOut(record), record: None, reserved: Vec::new(), pin: None }
}

/// Refuses a keep-out that would be over before it began.
fn check_expiry(change: &KeepOutChange, now_ns: i64) -> Result<(), ServiceError> {
    match change.act {
        KeepOutAct::Put { expires_at_ns: Some(at), .. } if at <= now_ns => {
            let message = format!("expires_at_ns must lie in the future, got {at}, and it is {now_ns}");
            Err(ServiceError::new(Reason::BadExpiry, message))
        }
        _ => Ok(()),
    }
}

/// Tells one request from another under the same id, which is the caller's own.
fn digest(change: &KeepOutChange) -> u64 {
    let digest = Digest::new("keep_out").bytes(change.name.as_str().as_bytes());
    match &change.act {
        KeepOutAct::Put { shape, expires_at_ns, made_by: _ } => {
            let digest = match shape {
                KeepOutShape::Region(region) => digest.region(region),
                KeepOutShape::Prism(prism) => {
                    digest.bytes(b"prism").numbers(&prism.z_m()).numbers(prism.corners_m().as_flattened())
                }
            };
            expires_at_ns.map_or(digest.clone(), |at| digest.bytes(&at.to_le_bytes()))
        }
        KeepOutAct::Removed { .. } | KeepOutAct::Expired => digest.bytes(b"removed"),
    }
    .finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{CallerName, Region};

    fn put(name: &str, radius_m: f64, expires_at_ns: Option<i64>) -> KeepOutChange {
        let shape = KeepOutShape::of_region(Region::ball([0.0; 3], radius_m).unwrap()).unwrap();
        let made_by = Some(CallerName::new("a").unwrap());
        KeepOutChange {
            name: KeepOutName::new(name).unwrap(),
            act: KeepOutAct::Put { shape, made_by, expires_at_ns },
        }
    }

    #[test]
    fn requests_are_told_apart_by_name_shape_expiry_and_what_is_done() {
        let removal = KeepOutChange { act: KeepOutAct::Removed { by: None }, ..put("a", 1.0, None) };
        let others = [
            put("b", 1.0, None),
            put("a", 2.0, None),
            put("a", 1.0, Some(7)),
            put("a", 1.0, Some(8)),
            removal,
        ];
        let digests: std::collections::BTreeSet<u64> = others.iter().map(digest).collect();
        assert_eq!(digests.len(), others.len());
        assert!(!digests.contains(&digest(&put("a", 1.0, None))));
        assert_eq!(digest(&put("b", 1.0, None)), digest(&others[0]));
    }

    #[test]
    fn an_expiry_must_lie_in_the_future() {
        assert!(
            check_expiry(&put("a", 1.0, Some(8)), 7).is_ok() && check_expiry(&put("a", 1.0, None), 7).is_ok()
        );
        let refused = check_expiry(&put("a", 1.0, Some(7)), 7).unwrap_err();
        assert_eq!(refused.reason, Reason::BadExpiry);
        assert_eq!(refused.message, "expires_at_ns must lie in the future, got 7, and it is 7");
    }
}
