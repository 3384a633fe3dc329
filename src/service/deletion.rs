//! How voxels leave a map.

use std::sync::Arc;

use super::committing::{Proposal, Refusal, Step};
use super::digest::Digest;
use super::hosted_map::HostedMap;
use super::room::Room;
use super::{Deletion, DeletionAnswer, DeletionTarget, ErrorCode, ServiceError};
use crate::geometry::Point;
use crate::map::{AnsweredRequest, Change, Committed, DeletionRecord, Region, Request};
use crate::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey, VoxelSet};

impl HostedMap {
    /// Sets a deletion on its way, unless it was done before.
    pub(super) fn propose_deletion(
        self: &Arc<Self>,
        deletion: &Arc<Deletion>,
        room: &Room,
    ) -> Result<Step<DeletionAnswer>, ServiceError> {
        self.check_writable()?;
        let request = deletion.request_id.clone().map(|id| Request { id, digest: digest(deletion) });
        if let Some(answered) = self.answered(request.as_ref())? {
            let state = self.state(answered.revision);
            return Ok(Step::Answered(DeletionAnswer { removed: answered.voxels, state, replayed: true }));
        }
        room.check_to_shrink()?;
        let (map, deletion) = (Arc::clone(self), Arc::clone(deletion));
        // Which voxels are meant is decided when nobody else can change the map.
        let decide = move |_: &_| {
            map.still_unanswered(request.as_ref())?;
            let voxels = map.targets_of(&deletion)?;
            Ok((!voxels.is_empty()).then_some(Change::Deletion(DeletionRecord { voxels, request })))
        };
        let outcome = self.committing.propose(Proposal::Undecided(Box::new(decide)));
        let map = Arc::clone(self);
        let answer = move |Committed { revision, voxels: removed }| DeletionAnswer {
            removed,
            state: map.state(revision),
            replayed: false,
        };
        Ok(Step::Proposed(outcome, Box::new(answer)))
    }

    /// What came of a request the first time.
    pub(super) fn answered(
        &self,
        request: Option<&Request>,
    ) -> Result<Option<AnsweredRequest>, ServiceError> {
        let Some(request) = request else {
            return Ok(None);
        };
        match self.map.requests().find(&request.id) {
            Some(answered) if answered.digest != request.digest => {
                let message = format!(
                    "request_id {} was accepted at revision {} with other content: name new requests anew",
                    request.id, answered.revision
                );
                Err(ServiceError::new(ErrorCode::Conflict, "request_id_taken", message))
            }
            answered => Ok(answered.cloned()),
        }
    }

    /// The same request may have come twice, and the other one first.
    pub(super) fn still_unanswered(&self, request: Option<&Request>) -> Result<(), Refusal> {
        if self.answered(request)?.is_some() { Err(Refusal::Stale) } else { Ok(()) }
    }

    fn targets_of(&self, deletion: &Deletion) -> Result<VoxelSet, ServiceError> {
        let level = deletion.level;
        let keys = match &deletion.target {
            DeletionTarget::Points(points) => self.keys_of(points.as_slice(), level)?,
            DeletionTarget::Keys(keys) => {
                keys.iter().map(|&key| in_range(key, level)).collect::<Result<_, _>>()?
            }
            DeletionTarget::Region(region) => self.map.view().voxels_in(region, level),
        };
        Ok(self.map.view().descendants_of(keys, level))
    }

    fn keys_of(&self, points: &[Point], level: u32) -> Result<Vec<VoxelKey>, ServiceError> {
        let quantise = self.map.lattice().from_map();
        let keys: Option<Vec<_>> =
            points.iter().map(|&point| Some(quantise.key(point)?.ancestor(level))).collect();
        keys.ok_or_else(|| self.point_without_voxel(points, &quantise))
    }
}

fn in_range(key: VoxelKey, level: u32) -> Result<VoxelKey, ServiceError> {
    let range = INDEX_MIN >> level..=INDEX_MAX >> level;
    if key.index().iter().all(|i| range.contains(i)) {
        return Ok(key);
    }
    let message = format!(
        "keys has {key:?}, whose indices must lie in {}..={} at level {level}",
        range.start(),
        range.end()
    );
    Err(ServiceError::invalid("key_out_of_range", message))
}

/// Tells one request from another under the same id.
fn digest(deletion: &Deletion) -> u64 {
    let digest = Digest::default().number(u64::from(deletion.level));
    match &deletion.target {
        DeletionTarget::Points(points) => digest.bytes(bytemuck::cast_slice(points.as_slice())),
        DeletionTarget::Keys(keys) => {
            keys.iter().fold(digest.number(1), |digest, key| digest.number(key.to_bits()))
        }
        DeletionTarget::Region(Region::Box { min_m, max_m }) => digest.numbers(min_m).numbers(max_m),
        DeletionTarget::Region(Region::Sphere { center_m, radius_m }) => {
            digest.numbers(center_m).numbers(&[*radius_m])
        }
    }
    .finish()
}
