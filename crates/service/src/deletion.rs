//! How voxels leave a map.

use std::sync::Arc;

use super::commit_queue::{Decided, Refusal, Step, Submission};
use super::digest::{Digest, FormerDigest};
use super::hosted_map::HostedMap;
use super::resource_budget::ResourceBudget;
use super::{
    Deletion, DeletionAnswer, DeletionTarget, NotSeenSince, Reason, ServiceError, check_not_stopped,
};
use mrol_map::geometry::Point;
use mrol_map::map::{
    CallerName, Change, Committed, CompletedRequest, DeletionRecord, MultiResolutionMap, Region, Request,
    RequestKind, SHARDS,
};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{BlockMask, INDEX_MAX, INDEX_MIN, VoxelKey, VoxelSet};

impl HostedMap {
    /// Sets a deletion on its way, unless it was done before.
    pub(super) fn submit_deletion(
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
        if let Some(answered) = self.answered(RequestKind::Deletion, request.as_ref(), former)? {
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
            let lent = budget.reserve_transient(search_bytes(core, &deletion), "a deletion")?;
            let voxels = match unseen {
                Some(unseen) => unseen.decided(&map, core, stop)?,
                None => map.targets_of(&deletion, stop)?,
            };
            if voxels.is_empty() {
                return Ok(None);
            }
            drop(lent);
            let lent = vec![budget.reserve_transient(removal_bytes(core, &voxels), "a deletion")?];
            let change = Change::Deletion(DeletionRecord { voxels, request });
            Ok(Some(Decided { change, record: None, lent, pin: None }))
        };
        let outcome = self.commit_queue.submit(Submission::Undecided(Box::new(decide)))?;
        let map = Arc::clone(self);
        let answer = move |committed: Committed| DeletionAnswer {
            removed: committed.removed,
            version: map.version(committed.version()),
            replayed: false,
        };
        Ok(Step::Submitted(outcome, Box::new(answer)))
    }

    /// What came of a request the first time.
    pub(super) fn answered(
        &self,
        kind: RequestKind,
        request: Option<&Request>,
        former_digest: u64,
    ) -> Result<Option<CompletedRequest>, ServiceError> {
        let Some(request) = request else {
            return Ok(None);
        };
        match self.map.requests().find(kind, &request.id, request.caller.as_ref()) {
            Some(answered) if ![request.digest, former_digest].contains(&answered.digest) => {
                let message = format!(
                    "request_id {} was accepted at revision {} with other content: name new requests anew",
                    request.id, answered.revision
                );
                Err(ServiceError::new(Reason::RequestIdTaken, message))
            }
            answered => Ok(answered.cloned()),
        }
    }

    /// Refuses or answers a request that came twice, where the other one was first.
    pub(super) fn still_unanswered(
        &self,
        kind: RequestKind,
        request: Option<&Request>,
        former_digest: u64,
    ) -> Result<(), Refusal> {
        if self.answered(kind, request, former_digest)?.is_some() { Err(Refusal::Stale) } else { Ok(()) }
    }

    fn targets_of(&self, deletion: &Deletion, stop: StopSignal<'_>) -> Result<VoxelSet, ServiceError> {
        let level = deletion.level;
        let keys: Vec<VoxelKey> = match &deletion.target {
            DeletionTarget::Points(points) => self.keys_of(points.as_slice(), level)?,
            DeletionTarget::Keys(keys) => {
                keys.iter().map(|&key| in_range("keys", key, level)).collect::<Result<_, _>>()?
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
        keys.ok_or_else(|| self.point_without_voxel(points, &quantize))
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

/// Memory that taking voxels out takes: two copies of their blocks, their record, the keys of one shard's voxels with
/// what their filters lose, and a copy of the filters' planes.
pub(super) fn removal_bytes(map: &MultiResolutionMap, voxels: &VoxelSet) -> u64 {
    const OF_RECORD: usize = 3;
    const OF_SHARD: usize = 36;
    let count = voxels.len();
    let planes = map.plane_bytes().min(count * 64);
    (2 * voxels.blocks().len() * BLOCK_BYTES + count * OF_RECORD + count * OF_SHARD / SHARDS + planes) as u64
}

/// A block's key and mask.
const BLOCK_BYTES: usize = size_of::<(VoxelKey, BlockMask)>();

/// The key, which is one of a voxel of `level`.
pub(super) fn in_range(field: &str, key: VoxelKey, level: u32) -> Result<VoxelKey, ServiceError> {
    let range = INDEX_MIN >> level..=INDEX_MAX >> level;
    if key.index().iter().all(|i| range.contains(i)) {
        return Ok(key);
    }
    let message = format!(
        "{field} has {key:?}, whose indices must lie in {}..={} at level {level}",
        range.start(),
        range.end()
    );
    Err(ServiceError::new(Reason::KeyOutOfRange, message))
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
