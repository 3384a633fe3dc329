//! Deletions (`mapping.proto`).

use super::occupancy::keys_from;
use super::pb;
use super::values::{InField, count_from, request_id_from, required, text_of};
use mrol_map::map::{MapName, Region};
use mrol_service::{Deletion, DeletionAnswer, DeletionTarget, NotSeenSince, ServiceError};

impl TryFrom<pb::DeleteVoxelsRequest> for (MapName, Deletion) {
    type Error = ServiceError;

    fn try_from(request: pb::DeleteVoxelsRequest) -> Result<Self, ServiceError> {
        use pb::delete_voxels_request::Target;
        let target = match required(request.target, "target")? {
            Target::Points(points) => DeletionTarget::Points(points.try_into().in_field("points")?),
            Target::Keys(keys) => DeletionTarget::Keys(keys_from(&keys.keys)?),
            Target::Region(region) => DeletionTarget::Region(Region::try_from(region)?),
        };
        let target = target.not_seen_since(request.not_seen_since)?;
        let request_id = request_id_from(&request.request_id)?;
        Ok((MapName::new(&request.map)?, Deletion { target, level: request.level, request_id }))
    }
}

impl From<(&MapName, Deletion)> for pb::DeleteVoxelsRequest {
    fn from((map, deletion): (&MapName, Deletion)) -> Self {
        use pb::delete_voxels_request::Target;
        let not_seen_since = match &deletion.target {
            DeletionTarget::NotSeenSince(target) => Some(target.revision),
            DeletionTarget::Points(_) | DeletionTarget::Keys(_) | DeletionTarget::Region(_) => None,
        };
        let target = match deletion.target {
            DeletionTarget::Points(points) => Target::Points(points.into()),
            DeletionTarget::Keys(keys) => {
                Target::Keys(pb::VoxelKeys { keys: keys.iter().map(|key| key.to_bits()).collect() })
            }
            DeletionTarget::Region(region) | DeletionTarget::NotSeenSince(NotSeenSince { region, .. }) => {
                Target::Region(region.into())
            }
        };
        let request_id = text_of(deletion.request_id);
        Self { map: map.to_string(), target: Some(target), level: deletion.level, request_id, not_seen_since }
    }
}

impl From<DeletionAnswer> for pb::DeleteVoxelsResponse {
    fn from(answer: DeletionAnswer) -> Self {
        let DeletionAnswer { removed, version, replayed } = answer;
        Self { removed: removed as u64, version: Some(version.into()), replayed }
    }
}

impl TryFrom<pb::DeleteVoxelsResponse> for DeletionAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::DeleteVoxelsResponse) -> Result<Self, ServiceError> {
        let version = required(answer.version, "version")?.try_into()?;
        Ok(Self { removed: count_from(answer.removed), version, replayed: answer.replayed })
    }
}
