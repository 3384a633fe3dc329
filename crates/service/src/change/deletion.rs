//! How voxels leave a map.

use std::sync::Arc;

use super::digest::{Digest, FormerDigest};
use crate::commit::{Decided, Step, Submission};
use crate::error::ServiceError;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::{self, Outcome};
use crate::request::{
    Deletion, DeletionAnswer, DeletionTarget, NotSeenSince, key_in_range, point_without_voxel,
};
use crate::resources::{BLOCK_BYTES, ResourceBudget, removal_bytes};
use crate::work::{Requester, TimeLimit, check_not_stopped};
use mrol_map::geometry::Point;
use mrol_map::map::{
    CallerName, Change, Committed, DeletionRecord, MapName, MultiResolutionMap, Region, Request, RequestKind,
};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{VoxelKey, VoxelSet};

impl MapService {
    /// Takes voxels out, with all their descendants.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel, a key out of the level's range, a level that is none, too many
    /// of them; `NotFound`; `ResourceExhausted` while the disk is nearly full.
    pub async fn delete_voxels(
        &self,
        map: &MapName,
        deletion: Deletion,
    ) -> Result<DeletionAnswer, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            map.check_level(deletion.level)?;
            match &deletion.target {
                DeletionTarget::Points(points) => self.limits().check_points(points.len())?,
                DeletionTarget::Keys(keys) => self.limits().check_keys(keys.len())?,
                DeletionTarget::Region(_) | DeletionTarget::NotSeenSince(_) => {}
            }
            let deletion = Arc::new(deletion);
            self.at_the_leader(
                &map,
                || self.delete_here(&map, &deletion),
                |leader, call| {
                    let deletion = Deletion::clone(&deletion);
                    async move { leader.delete_voxels(&call, deletion).await }
                },
            )
            .await
        };
        self.observed("DeleteVoxels", Some(map), work, |answer| {
            Outcome::Changed(observer::Change::of_deletion(answer))
        })
        .await
    }

    async fn delete_here(
        &self,
        map: &Arc<HostedMap>,
        deletion: &Arc<Deletion>,
    ) -> Result<DeletionAnswer, ServiceError> {
        // The scans that touched each voxel since are read from the journal, as for an undo.
        let reads_journal = matches!(deletion.target, DeletionTarget::NotSeenSince(_));
        let lane = if reads_journal { &self.inner.lanes.undo } else { &self.inner.lanes.mapping };
        let limit = TimeLimit::new("undo_time_max", self.limits().undo_time_max_s);
        let (of, inner) = (Arc::clone(map), Arc::clone(&self.inner));
        let (deletion, caller) = (Arc::clone(deletion), self.caller.clone());
        let submit = move |stop: StopSignal<'_>| {
            let submit =
                |stop: StopSignal<'_>| of.prepare_deletion(&deletion, caller.as_ref(), &inner.budget, stop);
            if reads_journal { limit.run(stop, submit) } else { submit(stop) }
        };
        let requester = Requester::from(&self.asker);
        self.submit_and_wait(("DeleteVoxels", map), (lane, &requester), None, submit).await
    }
}

impl HostedMap {
    /// Prepares a deletion, unless it was done before.
    pub(crate) fn prepare_deletion(
        self: &Arc<Self>,
        deletion: &Arc<Deletion>,
        caller: Option<&CallerName>,
        budget: &Arc<ResourceBudget>,
        stop: StopSignal<'_>,
    ) -> Result<Step<DeletionAnswer>, ServiceError> {
        self.check_writable()?;
        let request = deletion.request_id.clone().map(|id| Request {
            id,
            digest: digest(deletion),
            caller: caller.cloned(),
        });
        let former = former_digest(deletion);
        let answered = self.answered(RequestKind::Deletion, request.as_ref(), former)?;
        if let Some(answered) = answered {
            let version = self.version_at(answered.revision);
            return Ok(Step::Answered(DeletionAnswer { removed: answered.removed, version, replayed: true }));
        }
        budget.check_to_shrink()?;
        let unseen = match &deletion.target {
            DeletionTarget::NotSeenSince(target) => {
                Some(self.find_unseen(target, deletion.level, budget, stop)?)
            }
            DeletionTarget::Points(_) | DeletionTarget::Keys(_) | DeletionTarget::Region(_) => None,
        };
        let (map, deletion, budget) = (Arc::clone(self), Arc::clone(deletion), Arc::clone(budget));
        // Which voxels are meant is decided when nobody else can change the map.
        let decide = move |core: &MultiResolutionMap, stop: StopSignal<'_>| {
            map.still_unanswered(RequestKind::Deletion, request.as_ref(), former)?;
            let reserved = budget.reserve_transient(search_bytes(core, &deletion), "a deletion")?;
            let voxels = match unseen {
                Some(unseen) => unseen.decided(&map, core, stop)?,
                None => map.targets_of(&deletion, stop)?,
            };
            if voxels.is_empty() {
                return Ok(None);
            }
            drop(reserved);
            let reserved = vec![budget.reserve_transient(removal_bytes(core, &voxels), "a deletion")?];
            let change = Change::Deletion(DeletionRecord { voxels, request });
            Ok(Some(Decided { change, record: None, reserved, pin: None }))
        };
        let map = Arc::clone(self);
        let answer = move |committed: Committed| DeletionAnswer {
            removed: committed.removed,
            version: map.version(committed.version()),
            replayed: false,
        };
        Ok(Step::Ready(Submission::Undecided(Box::new(decide)), Box::new(answer)))
    }

    fn targets_of(&self, deletion: &Deletion, stop: StopSignal<'_>) -> Result<VoxelSet, ServiceError> {
        let level = deletion.level;
        let keys: Vec<VoxelKey> = match &deletion.target {
            DeletionTarget::Points(points) => self.keys_of(points.as_slice(), level)?,
            DeletionTarget::Keys(keys) => {
                keys.iter().map(|&key| key_in_range("keys", key, level)).collect::<Result<_, _>>()?
            }
            DeletionTarget::Region(region) | DeletionTarget::NotSeenSince(NotSeenSince { region, .. }) => {
                let found = self.map.long_read().view().finest_in_until(region, level, stop);
                return check_not_stopped(stop).map(|()| found);
            }
        };
        Ok(self.map.long_read().view().descendants_of(keys, level))
    }

    fn keys_of(&self, points: &[Point], level: u32) -> Result<Vec<VoxelKey>, ServiceError> {
        let quantize = self.map.lattice().from_map();
        let keys: Option<Vec<_>> =
            points.iter().map(|&point| Some(quantize.key(point)?.ancestor(level))).collect();
        keys.ok_or_else(|| point_without_voxel(points, &quantize, self.map.lattice()))
    }
}

/// Memory that finding out which voxels a deletion means takes: what it names, and the blocks of what it finds, which
/// are not more than the map has.
fn search_bytes(map: &MultiResolutionMap, deletion: &Deletion) -> u64 {
    let named = match &deletion.target {
        DeletionTarget::Points(points) => points.len(),
        DeletionTarget::Keys(keys) => keys.len(),
        DeletionTarget::Region(_) | DeletionTarget::NotSeenSince(_) => 0,
    };
    (named * (size_of::<VoxelKey>() + BLOCK_BYTES) + 2 * map.set_bytes()) as u64
}

/// Tells one request from another under the same id.
fn digest(deletion: &Deletion) -> u64 {
    let digest = Digest::new("deletion").number(u64::from(deletion.level));
    match &deletion.target {
        DeletionTarget::Points(points) => {
            digest.bytes(b"points").bytes(bytemuck::cast_slice(points.as_slice()))
        }
        DeletionTarget::Keys(keys) => {
            let bits: Vec<u64> = keys.iter().map(|key| key.to_bits()).collect();
            digest.bytes(b"keys").bytes(bytemuck::cast_slice(&bits))
        }
        DeletionTarget::Region(region) => digest.region(region),
        DeletionTarget::NotSeenSince(NotSeenSince { region, revision }) => {
            digest.bytes(b"not_seen_since").number(*revision).region(region)
        }
    }
    .finish()
}

/// The digest of the same request in data folders of version 3 and before.
fn former_digest(deletion: &Deletion) -> u64 {
    let digest = FormerDigest::default().number(u64::from(deletion.level));
    match &deletion.target {
        DeletionTarget::Points(points) => digest.bytes(bytemuck::cast_slice(points.as_slice())),
        DeletionTarget::Keys(keys) => {
            keys.iter().fold(digest.number(1), |digest, key| digest.number(key.to_bits()))
        }
        DeletionTarget::Region(Region::Box { min_m, max_m }) => digest.numbers(min_m).numbers(max_m),
        DeletionTarget::Region(Region::Sphere { center_m, radius_m }) => {
            digest.numbers(center_m).numbers(&[*radius_m])
        }
        // There were none then: this is no digest of theirs.
        DeletionTarget::Region(Region::OrientedBox(_)) | DeletionTarget::NotSeenSince(_) => {
            return self::digest(deletion);
        }
    }
    .finish()
}
